"""The robot languages: one folder each, with the same file names in each, and one line in `LANGUAGES`."""

from respot.languages.krl import KRL
from respot.languages.language import Language
from respot.languages.rapid import RAPID

LANGUAGES: dict[str, Language] = {language.name: language for language in (KRL, RAPID)}

__all__ = ["LANGUAGES", "Language"]
