"""Odd inputs over all verbs: one line and exit code 2, or an answer in finite numbers."""

import pytest

from tests import odd


def test_odd_inputs_are_answered_well():
    assert [f"{case.words}: {wrong}" for case, wrong in odd.answers(1, 200)] == []


@pytest.mark.slow
def test_more_odd_inputs_are_answered_well():
    assert [f"{case.words}: {wrong}" for case, wrong in odd.answers(2, 1800, long=True)] == []


def test_bad_answers_are_noticed(tmp_path, monkeypatch):
    """A traceback, a warning, two lines, a file beside a refusal, an infinite number."""
    out = tmp_path / "out"

    def answer(words):
        if words == ("raise",):
            raise KeyError("x")
        if words == ("warn",):
            odd.np.float64(1.0) / odd.np.float64(0.0)
        if words == ("lines",):
            print("one\ntwo", file=odd.sys.stderr)
        if words == ("files",):
            print("one", file=odd.sys.stderr)
            out.mkdir()
        if words == ("infinite",):
            out.mkdir()
            (out / "table.csv").write_text("power_W\ninf\n")
            return 0
        return 2

    monkeypatch.setattr(odd, "exit_code", answer)
    said = {}
    for word in ("raise", "warn", "lines", "files", "infinite"):
        odd.shutil.rmtree(out, ignore_errors=True)
        said[word] = odd.fault(odd.Case((word,), ""), out)
    starts = (
        "traceback: ",
        "warning: ",
        "refused in 2",
        "refused, and leaves",
        "table.csv: an inf",
    )
    assert all(text.startswith(start) for text, start in zip(said.values(), starts, strict=True))
