"""The surface that most contact tests press."""

import pytest
from contact_cases import rough_surface


@pytest.fixture(scope="session")
def rough():
    return rough_surface()
