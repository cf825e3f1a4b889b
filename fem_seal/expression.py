"""Formulas in x, y, r and theta, evaluated on their syntax tree without executing code.

Python's parser makes the tree. Only numbers, names, arithmetic and calls of the functions below are
evaluated; attributes, indices, strings and all else raise InvalidInput. (The parsers of sympy and
numexpr pass the text to `eval`.)
"""

import ast
import operator
from collections.abc import Callable

import numpy as np

from fem_seal.errors import InvalidInput

FUNCTIONS: dict[str, np.ufunc] = {
    "abs": np.abs,
    "arctan2": np.arctan2,
    "cos": np.cos,
    "exp": np.exp,
    "log": np.log,
    "max": np.maximum,
    "min": np.minimum,
    "sin": np.sin,
    "sqrt": np.sqrt,
    "tan": np.tan,
    "tanh": np.tanh,
}
VARIABLES = ("x", "y", "r", "theta", "pi")

# NumPy's numbers and arrays; both divide by 0 and overflow without an exception, unlike a float.
Value = np.ndarray | np.floating

_OPERATORS: dict[type[ast.AST], Callable[..., Value]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
LONGEST = 1000  # most characters of a formula, so that it cannot exhaust the parser


def evaluate(text: str, points: np.ndarray, middle: float = 0.0) -> np.ndarray:
    """Values (n,) of a formula, such as "5e-6 * (1 + 0.2 * cos(3 * theta))", in metres, at points.

    The points (n, 2) are coordinates x, y [m]; r and theta are the polar ones, and theta [rad] lies
    within π of `middle`. Inf or nan where the formula has no finite value.
    """
    tree = _parsed(text)
    x, y = points.T
    theta = np.arctan2(y, x)
    if middle != 0:
        theta += 2 * np.pi * np.rint((middle - theta) / (2 * np.pi))
    values: tuple[Value, ...] = (x, y, np.hypot(x, y), theta, np.float64(np.pi))
    names = dict(zip(VARIABLES, values, strict=True))
    try:
        with np.errstate(all="ignore"):
            value = _value(tree, names, text)
    except RecursionError:
        raise InvalidInput(f"the expression {text[:20]!r}... is nested too deeply") from None
    return np.broadcast_to(np.asarray(value, dtype=float), (len(points),)).copy()


def check_formula(text: str) -> None:
    """Raise InvalidInput if the text is not a formula."""
    evaluate(text, np.ones((1, 2)))


def _parsed(text: str) -> ast.expr:
    """Syntax tree of a text; InvalidInput if it is too long or not an expression."""
    if len(text) > LONGEST:
        raise InvalidInput(f"the expression has {len(text)} characters; at most {LONGEST} are read")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InvalidInput(f"{text!r} is not an expression in {', '.join(VARIABLES)}") from None


def _value(node: ast.expr, names: dict[str, Value], text: str) -> Value:
    """Value of a node of the syntax tree; InvalidInput if its kind is not allowed."""
    match node:
        case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
            # Convert the digits: an integer beyond the largest float64 then becomes inf.
            return np.float64(repr(node.value))
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(operand, names, text))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(left, names, text), _value(right, names, text))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            count = FUNCTIONS[name].nin
            if len(args) != count:
                raise InvalidInput(f"{name} in {text!r} takes {count} arguments, not {len(args)}")
            return FUNCTIONS[name](*(_value(argument, names, text) for argument in args))
    part = ast.get_source_segment(text.strip(), node) or text
    raise InvalidInput(
        f"{part!r} in {text!r} is not allowed; use numbers, {', '.join(VARIABLES)}, + - * / ** "
        f"and {', '.join(FUNCTIONS)}"
    )
