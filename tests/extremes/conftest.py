"""How a case of an extreme shows in docs/measurements/limits.md."""

from collections.abc import Callable
from inspect import getdoc

import pytest


@pytest.fixture
def show(
    request: pytest.FixtureRequest, record_property: Callable[[str, object], None]
) -> Callable[[str, str], None]:
    """Record outcome (right, refused, limited) and evidence, a row of docs/measurements/limits.md.

    The part of the page is PART of the test's module, the extreme the first sentence of the
    test's docstring, the case the id of its parameters.
    """

    def show(outcome: str, evidence: str) -> None:
        extreme = getdoc(request.function).partition(".\n")[0].rstrip(".")
        case = request.node.callspec.id if hasattr(request.node, "callspec") else ""
        record_property("row", (request.module.PART, extreme, case, outcome, evidence))

    return show
