"""Load paths give the states of single loads, with less work. By area and mean gap: campaign."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, SOLID, load_path, pressed, rough_surface

from fem_seal.contact import ContactStopping, Load


def test_warm_starts_save_work():
    """On four surfaces the path took 0.58 to 0.61 of the transforms, half from the third on."""
    height, parts = rough_surface((128, 128), short=1), np.linspace(0.15, 0.3, 8)
    loads = [Load("pressure", part * E_STAR * SLOPE) for part in parts.tolist()]
    warm = [state.fft_pairs for state in load_path(height, SOLID, loads)]
    cold = [pressed(height, part).fft_pairs for part in parts]
    assert sum(warm) < 0.7 * sum(cold)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("solver", ["free-set-cg", "polonsky-keer"])
def test_mean_of_two_states_is_no_contact(rough, tolerance, solver):
    """It presses wherever one of them touches, with a certificate that may pass at once.

    The contact found has to be as right as it says: wrong in no larger a share of the touching
    samples than its own certificate, give or take one sample. The mean itself is wrong in 1.5 %.
    """
    below, above = (pressed(rough, part).pressure.values for part in (0.196, 0.204))
    between = (below + above) / 2
    exact = pressed(rough, 0.2, ContactStopping(tolerance=1e-11)).contact
    assert np.count_nonzero(between) > 1.01 * np.count_nonzero(exact)
    for start in (None, between):
        found = pressed(rough, 0.2, ContactStopping(solver, tolerance), start=start)
        wrong = np.count_nonzero(found.contact != exact)
        assert wrong <= found.certificate * np.count_nonzero(exact) + 1
