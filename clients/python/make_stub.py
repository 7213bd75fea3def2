"""Writes ``messages.pyi``, the types of the messages, from the descriptors in the package: after `cargo xtask proto`.

python clients/python/make_stub.py
"""

import keyword
from pathlib import Path

from tactus_client import messages

STUB = Path(__file__).parent / "src" / "tactus_client" / "messages.pyi"
BEGINNING = '''"""Types of the messages of ``tactus.v1``. Written by make_stub.py."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError as DecodeError
from google.protobuf.message import Message

PACKAGE: str
POOL: DescriptorPool

def encoding(message_class: type[Message]) -> str: ...
def name_of(message: Message, field: str) -> str: ...
def word_of(message: Message, field: str) -> str: ...
def to_dict(message: Message) -> dict[str, Any]: ...
def is_repeated(field: Any) -> bool: ...
'''


def stub() -> str:
    """The text of the stub."""
    classes = sorted(name for name in messages.__all__ if hasattr(getattr(messages, name), "DESCRIPTOR"))
    return BEGINNING + "".join(_class(getattr(messages, name).DESCRIPTOR) for name in classes)


def _class(descriptor) -> str:
    # A field whose name is a word of Python can be reached with getattr only.
    fields = [field for field in descriptor.fields if not keyword.iskeyword(field.name)]
    lines = [f"\nclass {descriptor.name}(Message):"]
    lines += [f"    {field.name}: {_type(field)}" for field in fields]
    arguments = "".join(f", {field.name}: {_argument(field)} = ..." for field in fields)
    lines.append(f"    def __init__(self{', *' if arguments else ''}{arguments}) -> None: ...")
    return "\n".join(lines) + "\n"


def _type(field) -> str:
    if _is_map(field):
        return f"Mapping[{', '.join(_one(part) for part in field.message_type.fields)}]"
    return f"Sequence[{_one(field)}]" if messages.is_repeated(field) else _one(field)


def _argument(field) -> str:
    if _is_map(field) or not messages.is_repeated(field):
        # An enum is set by its number or its name.
        return f"{_type(field)} | {'str | ' if field.enum_type else ''}None"
    return f"Iterable[{_one(field)}] | None"


def _one(field) -> str:
    if field.message_type is not None:
        return field.message_type.name
    kinds = {
        field.CPPTYPE_BOOL: "bool",
        field.CPPTYPE_FLOAT: "float",
        field.CPPTYPE_DOUBLE: "float",
        field.CPPTYPE_STRING: "bytes" if field.type == field.TYPE_BYTES else "str",
    }
    return kinds.get(field.cpp_type, "int")


def _is_map(field) -> bool:
    return field.message_type is not None and field.message_type.GetOptions().map_entry


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
