"""Load paths give the states of single loads, with less work. By area and mean gap: campaign."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, SOLID, load_path, rough_surface

from fem_seal.contact import ContactStopping, Load, press


def under(pressures):
    return [Load("pressure", float(pressure)) for pressure in pressures]


def test_warm_starts_save_work():
    """A fifth of it: a few transforms might be chance."""
    height = rough_surface((128, 128), short=1)
    pressures = np.linspace(0.15, 0.3, 8) * E_STAR * SLOPE
    warm = [state.fft_pairs for state in load_path(height, SOLID, under(pressures))]
    cold = [press(height, SOLID, Load("pressure", pressure)).fft_pairs for pressure in pressures]
    assert sum(warm) < 0.8 * sum(cold)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("solver", ["free-set-cg", "polonsky-keer"])
def test_mean_of_two_states_is_no_contact(rough, tolerance, solver):
    """It presses wherever one of them touches, with a certificate that may pass at once.

    The contact found has to be as right as it says: wrong in no larger a share of the touching
    samples than its own certificate, give or take one sample. The mean itself is wrong in 1.5 %.
    """
    pressure = 0.2 * E_STAR * SLOPE
    below, above = (
        press(rough, SOLID, Load("pressure", share * pressure)) for share in (0.98, 1.02)
    )
    between = (below.pressure.values + above.pressure.values) / 2
    exact = press(
        rough, SOLID, Load("pressure", pressure), ContactStopping(tolerance=1e-11)
    ).contact
    assert np.count_nonzero(between) > 1.01 * np.count_nonzero(exact)
    stopping = ContactStopping(solver, tolerance)
    for start in (None, between):
        found = press(rough, SOLID, Load("pressure", pressure), stopping, start=start)
        wrong = np.count_nonzero(found.contact != exact)
        assert wrong <= found.certificate * np.count_nonzero(exact) + 1
