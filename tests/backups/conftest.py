from tests.cli.conftest import respot

__all__ = ["respot"]
