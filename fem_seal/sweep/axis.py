"""What varies: a field and its values."""

import re
from dataclasses import dataclass

from fem_seal.errors import InvalidInput
from fem_seal.scene.files import parse_assignment

# Text without commas, and whole lists and quoted strings with theirs.
_VALUE = re.compile(r"""(?:[^,\[\]"']|\[[^\]]*\]|"[^"]*"|'[^']*')+""")


@dataclass(frozen=True)
class Axis:
    """A field such as "contact.pressure" and the values it takes, as they were written."""

    key: str
    values: tuple[str, ...]

    @classmethod
    def parse(cls, text: str) -> "Axis":
        """Read "key=v1,v2,..."; commas inside lists and quotes do not separate.

        Raises
        ------
        InvalidInput
            If the text is not of that form, or a value stands twice.
        """
        keys, listed = parse_assignment(text)
        values = tuple(value.strip() for value in _VALUE.findall(listed))
        whole = "".join(",".join(values).split()) == "".join(listed.split())
        if not (whole and values and all(values)):
            raise InvalidInput(f"{text!r} is not of the form section.key=v1,v2,...")
        if len(set(values)) < len(values):
            raise InvalidInput(f"{text!r} names a value twice")
        return cls(".".join(keys), values)
