"""ABB RAPID."""

from respot.languages.language import Language
from respot.languages.rapid import robot, writer
from respot.languages.rapid.forms import FORMS

RAPID = Language(
    name="rapid",
    title="ABB RAPID",
    suffixes=robot.SUFFIXES,
    forms=FORMS,
    read_robot=robot.read_robot,
    pose_values=writer.pose_values,
    decimals=writer.DECIMALS,
    has_configuration=writer.has_configuration,
    header_place=writer.header_place,
    configuration_fields=("cf1", "cf4", "cf6", "cfx"),
)
