"""The table of other libraries says what its rows do: those that need nothing more are run here."""

from __future__ import annotations

import csv

import pytest
import torch
from gymnasium.error import DependencyNotInstalled

from benchmarks.compatibility.__main__ import LIBRARIES, TABLE, rows_file
from benchmarks.compatibility.rows import rows_of

IN_TESTS = ("stable_baselines3", "gymnasium", "gymnasium_vector", "pettingzoo")
"""Libraries that the extra "dev" brings along."""
ROWS = [
    pytest.param(row, id=f"{library}-{name}")
    for library in IN_TESTS
    for name, row in rows_of(rows_file(library)).items()
]


@pytest.fixture(autouse=True)
def _one_thread():
    """Tiny networks are fastest with one."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.mark.parametrize("row", ROWS)
def test_a_row_of_the_table_goes_as_told(row):
    if row.fails:
        with pytest.raises(Exception):  # noqa: B017, PT011  (whatever the library raises)
            row.run(**row.keywords)
        return
    try:
        row.run(**row.keywords)
    except DependencyNotInstalled as error:
        if "cv2" not in str(error):  # large, and only scripts/compatibility installs it
            raise
        pytest.skip(str(error))


@pytest.mark.parametrize("row", [row for row in ROWS if row.values[0].keywords])
def test_a_row_of_the_table_needs_its_keywords(row):
    with pytest.raises(Exception):  # noqa: B017, PT011  (whatever the library raises)
        row.run()


def test_the_table_holds_every_row_and_no_other():
    with TABLE.open(newline="") as file:
        told = [(row["library"], row["what"]) for row in csv.DictReader(file)]
    rows = [(name, row.what) for name in LIBRARIES for row in rows_of(rows_file(name)).values()]
    assert told == [(name, what.replace("`", "")) for name, what in rows]
