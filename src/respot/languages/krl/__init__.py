"""KUKA Robot Language."""

from respot.languages.krl import blocks, recognition, robot, syntax, writer
from respot.languages.krl.forms import FORMS
from respot.languages.language import Language

KRL = Language(
    name="krl",
    title="KUKA KRL",
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
    configuration_fields=("S", "T"),
)
