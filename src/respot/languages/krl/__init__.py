"""KUKA Robot Language."""

from respot.languages.krl import robot, writer
from respot.languages.krl.forms import FORMS
from respot.languages.language import Language

KRL = Language(
    name="krl",
    title="KUKA KRL",
    suffixes=robot.SUFFIXES,
    forms=FORMS,
    read_robot=robot.read_robot,
    pose_values=writer.pose_values,
    decimals=writer.DECIMALS,
    has_configuration=writer.has_configuration,
    header_place=writer.header_place,
    configuration_fields=("S", "T"),
)
