"""What is compiled before the tests begin can be made."""

import pytest

from tests.kernels.compiled import KINDS, make


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_made(kind):
    make(kind)
