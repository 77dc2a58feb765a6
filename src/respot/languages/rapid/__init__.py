"""ABB RAPID."""

from respot.languages.language import Language
from respot.languages.rapid import blocks, recognition, robot, syntax, writer
from respot.languages.rapid.forms import FORMS

RAPID = Language(
    name="rapid",
    title="ABB RAPID",
    suffixes=robot.SUFFIXES,
    encodings=syntax.ENCODINGS,
    no_statement=syntax.NO_STATEMENT,
    recognise=recognition.recognise,
    read_statements=syntax.read_statements,
    block_issues=blocks.block_issues,
    forms=FORMS,
    read_robots=robot.read_robots,
    pose_values=writer.pose_values,
    decimals=writer.decimals,
    frame_decimals=writer.FRAME_DECIMALS,
    has_configuration=writer.has_configuration,
    header_place=writer.header_place,
    configuration_fields=("cf1", "cf4", "cf6", "cfx"),
)
