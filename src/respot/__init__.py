"""respot: from legacy robot backups to calibrated, production-ready robot programs."""

__version__ = "0.1.0"
