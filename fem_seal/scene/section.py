"""What a section of a scene is, and the types of its fields: frozen, checked, in SI units."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from fem_seal.errors import InvalidInput, InvalidScene
from fem_seal.scene.messages import ContradictionError, explain
from fem_seal.scene.readable import own_names, python_rows
from fem_seal.units import plain_number, to_si

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass

else:
    ModelMetaclass = type(BaseModel)


def _plain_number(value: object) -> object:
    plain_number(value, "must be a number")
    return value  # as it is given, for the message on a limit


def _whole_number(value: object) -> object:
    """Make a whole number of NumPy one of Python: the strict type takes no other."""
    return int(value) if isinstance(value, np.integer) else value


def readable_file(value: object, info: ValidationInfo) -> Path:
    """Existing file; relative paths count from the folder of the scene file."""
    if not isinstance(value, str | Path):
        raise ValueError("must be the path of a file, in quotes")
    folder = (info.context or {}).get("folder", Path())
    try:
        path = (folder / value).resolve()
    except (OSError, RuntimeError):  # RuntimeError: Python before 3.13, of links in a circle
        raise ValueError("is not a file: its links lead back to themselves") from None
    try:
        str(path).encode()
    except UnicodeEncodeError:
        # result.json records the path, and JSON is UTF-8.
        raise ValueError("has a name, or lies in a folder, that is not UTF-8; rename it") from None
    if path.is_dir():
        raise ValueError(f"is a folder (looked for {path}); name the file in it")
    if not path.is_file():
        raise ValueError(f"is not a file (looked for {path})")
    return path


Length = Annotated[float, BeforeValidator(partial(to_si, unit="m")), Field(gt=0)]
LineLoad = Annotated[float, BeforeValidator(partial(to_si, unit="N/m")), Field(gt=0)]
Coordinate = Annotated[float, BeforeValidator(partial(to_si, unit="m")), Field(ge=0)]
Pressure = Annotated[float, BeforeValidator(partial(to_si, unit="Pa")), Field(gt=0)]
NonNegativePressure = Annotated[float, BeforeValidator(partial(to_si, unit="Pa")), Field(ge=0)]
Viscosity = Annotated[float, BeforeValidator(partial(to_si, unit="Pa s")), Field(gt=0)]
Seconds = Annotated[float, BeforeValidator(partial(to_si, unit="s")), Field(gt=0)]
Bytes = Annotated[float, BeforeValidator(partial(to_si, unit="byte")), Field(gt=0)]
Number = Annotated[float, BeforeValidator(_plain_number)]
PoissonRatio = Annotated[float, BeforeValidator(_plain_number), Field(gt=-1, le=0.5)]
Count = Annotated[int, Strict(), BeforeValidator(_whole_number), Field(ge=1)]
Seed = Annotated[int, Strict(), BeforeValidator(_whole_number), Field(ge=0)]
Truth = Annotated[bool, Strict()]
Lift = Literal["none", "range", "resolved"]
InputFile = Annotated[Path, BeforeValidator(readable_file)]


class SectionType(ModelMetaclass):
    """Class of the sections: one made in Python is refused in the words of a scene file."""

    def __call__(self, *arguments: Any, **fields: Any) -> Any:
        """Make a section; the kind of a section that has one need not be said."""
        section: Any = self
        name = section.__name__
        if arguments and section.__init__ is BaseModel.__init__:
            first = next(name for name in section.model_fields if name != "kind")
            raise InvalidInput(f"{name} takes its fields by name, as in {name}({first}=…)")
        kind = section.model_fields.get("kind")
        choices = get_args(kind.annotation) if kind is not None and kind.is_required() else ()
        own_kind = {"kind": choices[0]} if len(choices) == 1 else {}
        try:
            return super().__call__(*arguments, **(own_kind | fields))
        except ValidationError as error:
            source = name if section.named_in_messages else ""
            raise InvalidScene(source, explain(error, section)) from None


class Section(BaseModel, metaclass=SectionType):
    """Base class of the sections: frozen, no unknown fields, no NaN."""

    #: whether a message names the section; a Scene's messages name it before each field anyway
    named_in_messages: ClassVar[bool] = True
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def _contradictions(self) -> Iterator[str]:
        """Sentences on fields that contradict each other; the first one counts."""
        yield from ()

    @model_validator(mode="after")
    def _check(self) -> "Section":
        for sentence in self._contradictions():
            raise ContradictionError(sentence)
        return self

    def __dir__(self) -> list[str]:
        """Names of a section, without those that pydantic adds."""
        return own_names(self)

    def __repr__(self) -> str:
        """The fields that were set, with readable units."""
        texts = ", ".join(f"{name}={text}" for name, text in python_rows(self))
        return f"{type(self).__name__}({texts})"

    __str__ = __repr__

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(
            f"{name} of a {type(self).__name__} cannot be set; scene.with_({{...}}) returns a "
            "changed copy of the scene"
        )


def is_changed(section: Section, name: str) -> bool:
    """Whether a field differs from its default.

    A field that is set may have it, as in the scene of a result, which names all fields.
    """
    return bool(getattr(section, name) != type(section).model_fields[name].default)


def not_one(section: Section, names: tuple[str, ...]) -> Iterator[str]:
    """Sentence if none or several of some fields are set."""
    fields = [name for name in names if getattr(section, name) is not None]
    if len(fields) != 1:
        got = f"got {' and '.join(fields)}" if fields else "got none"
        yield f"give exactly one of {', '.join(names)}; {got}"


def one_or_more(value: object) -> object:
    """A single value as a list of one."""
    return value if isinstance(value, list | tuple) else [value]


OneOrTwo = BeforeValidator(one_or_more), Field(min_length=1, max_length=2)
