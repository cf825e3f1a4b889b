"""JSON schema of a scene file, for editors that complete and check TOML."""

from functools import partial
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from fem_seal.scene.measured import one_or_more
from fem_seal.scene.scene import Scene
from fem_seal.scene.shape import along_second_axis
from fem_seal.units import to_si

QUANTITY = r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*[^\d\s].*$"  # a number and a unit


class _Schema(GenerateJsonSchema):
    """Schema of what a user writes, before it is converted to SI units."""

    def function_before_schema(
        self, schema: core_schema.BeforeValidatorFunctionSchema
    ) -> JsonSchemaValue:
        """Allow texts with a unit for numbers in SI units, and a single value for a list of one."""
        inner = self.generate_inner(schema["schema"])
        function = schema["function"]["function"]
        quantity = isinstance(function, partial) and function.func is to_si
        if quantity or function is along_second_axis:
            return {"anyOf": [inner, {"type": "string", "pattern": QUANTITY}]}
        if function is one_or_more:
            return {"anyOf": [inner, inner["items"]]}
        return inner

    def function_plain_schema(
        self, schema: core_schema.PlainValidatorFunctionSchema
    ) -> JsonSchemaValue:
        """Fields with a check of their own: leak rates, units, marks of missing points."""
        return {"type": ["number", "string"]}


def scene_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of a scene file."""
    schema = _of_toml(Scene.model_json_schema(schema_generator=_Schema))
    return {"$schema": _Schema.schema_dialect, **schema, "title": "fem_seal scene"}


# Beside a choice of types, and behind a validator, pydantic writes limits under its own names.
_LIMITS = {
    "gt": "exclusiveMinimum",
    "ge": "minimum",
    "lt": "exclusiveMaximum",
    "le": "maximum",
    "minLength": "minItems",
    "maxLength": "maxItems",
}


def _of_toml(node: Any) -> Any:
    """Schema without null, which TOML lacks, and with limits under the names of JSON schema."""
    if isinstance(node, list):
        return [_of_toml(item) for item in node]
    if not isinstance(node, dict):
        return node
    node = {key: _of_toml(value) for key, value in node.items()}
    if node.get("type") != "string":
        node = {_LIMITS.get(key, key): value for key, value in node.items()}
    if "anyOf" not in node:
        return node
    node["anyOf"] = [item for item in node["anyOf"] if item != {"type": "null"}]
    if "default" in node and node["default"] is None:
        del node["default"]
    return node
