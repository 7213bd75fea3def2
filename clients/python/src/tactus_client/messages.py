"""The messages of ``tactus.v1``.

The classes are made at import from the descriptors in this package (``tactus.binpb``, compiled from
``tactus.proto``), so no generated code has to match the protobuf runtime. A class has the name of its
message: ``Frame``, ``RunEvent``, ``CommandReply`` ...
"""

from __future__ import annotations

from importlib import resources

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

PACKAGE = "tactus.v1"


def _load():
    # A separate pool: other packages may bring other versions of the same messages.
    pool = descriptor_pool.DescriptorPool()
    files = descriptor_pb2.FileDescriptorSet.FromString(resources.files(__package__).joinpath("tactus.binpb").read_bytes())
    classes = {}
    for file in files.file:
        pool.AddSerializedFile(file.SerializeToString())
        for message in file.message_type:
            descriptor = pool.FindMessageTypeByName(f"{file.package}.{message.name}")
            classes[message.name] = message_factory.GetMessageClass(descriptor)
    return pool, classes


POOL, _CLASSES = _load()
globals().update(_CLASSES)
__all__ = [*_CLASSES, "DecodeError", "encoding", "is_repeated", "name_of", "to_dict", "word_of"]  # pyright: ignore[reportUnsupportedDunderAll]


def encoding(message_class) -> str:
    """The encoding string of a message on the bus, such as ``application/protobuf;tactus.v1.Frame``."""
    return f"application/protobuf;{message_class.DESCRIPTOR.full_name}"


def name_of(message, field: str) -> str:
    """The name of an enum value: ``name_of(state, "phase")`` gives, for example, ``RUN_PHASE_RUNNING``.

    A value that this version does not know is returned as its number.
    """
    number = getattr(message, field)
    value = message.DESCRIPTOR.fields_by_name[field].enum_type.values_by_number.get(number)
    return value.name if value else str(number)


def word_of(message, field: str) -> str:
    """The value of an enum in one word: ``word_of(state, "phase")`` gives, for example, ``running``."""
    prefix = message.DESCRIPTOR.fields_by_name[field].enum_type.values_by_number[0].name.removesuffix("UNSPECIFIED")
    return name_of(message, field).removeprefix(prefix).lower()


def to_dict(message) -> dict:
    """The fields of a message that are set, by name: enums as words, times as whole numbers."""

    def plain(field, value):
        if field.message_type is not None:
            return to_dict(value)
        return value if field.enum_type is None else word_of(message, field.name)

    def value_of(field, value):
        if field.message_type is not None and field.message_type.GetOptions().map_entry:
            return dict(value)
        return [plain(field, one) for one in value] if is_repeated(field) else plain(field, value)

    return {field.name: value_of(field, value) for field, value in message.ListFields()}


def is_repeated(field) -> bool:
    """True if the field of a descriptor is a list or a map."""
    # Protobuf 4 has no other way to ask; 7 has not this one.
    return field.is_repeated if hasattr(field, "is_repeated") else field.label == field.LABEL_REPEATED
