"""Every fault of the table can still be put in: its text stands once in its file."""

import pytest

from tests.faults import FAULTS


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f"{f['file']}: {f['old']}")
def test_a_fault_can_be_put_in(root, fault):
    text = (root / fault["file"]).read_text(encoding="utf-8")
    assert text.count(fault["old"]) == 1
    assert fault["new"] != fault["old"]
    assert all((root / test.partition("::")[0]).exists() for test in fault["tests"])
