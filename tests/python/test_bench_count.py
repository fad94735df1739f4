"""The gate on instruction counts: it reads callgrind rightly, and lets nothing pass that it should stop."""

import pytest
from benchmarks.instructions import table
from benchmarks.instructions.callgrind import Counted, Profile, read

# `work` calls `inner` twice, for 30 instructions each time; one line of it was inlined from another file.
OUTPUT = """\
positions: line
events: Ir
summary: 100
ob=(1) program
fl=(1) work.rs
fn=(1) work
10 25
fi=(2) inlined.rs
3 10
fe=(1)
+2 5
cfi=(3) inner.rs
cfn=(2) inner
calls=2 40
* 60
fl=(3)
fn=(2)
40 60
totals: 100
"""


def counted(**instructions):
    return [Counted(name.replace("_", "/"), 1, "step", Profile(total)) for name, total in instructions.items()]


def test_lines_count_for_the_file_they_come_from_and_calls_for_their_callers():
    profile = read(OUTPUT)
    assert profile.total == 100
    assert profile.by_file == {"work.rs": 30, "inlined.rs": 10, "inner.rs": 60}
    assert profile.by_function == {"work": 100, "inner": 60}


@pytest.mark.parametrize(("instructions", "is_refused"), [(1050, False), (1051, True), (950, False), (949, True)])
def test_a_count_may_be_five_percent_away_either_way(instructions, is_refused):
    _, problems = table.compare(counted(known_a=instructions), {"known/a": 1000})
    assert bool(problems) == is_refused


def test_a_program_that_is_new_or_gone_is_refused():
    _, problems = table.compare(counted(new=1), {"gone": 1})
    assert problems == ["new is not in the table", "gone is in the table, but there is no such program"]


def known(**instructions):
    names = [name for one, other, _ in table.ALIKE for name in (one, other)]
    return [
        Counted(name, 1, "step", Profile(total)) for name, total in (dict.fromkeys(names, 1000) | instructions).items()
    ]


@pytest.mark.parametrize("pair", table.ALIKE)
@pytest.mark.parametrize("is_other_way_round", [False, True])
def test_steps_over_known_ground_may_not_drift_further_apart(pair, is_other_way_round):
    *names, gate = pair
    cheap, dear = names[::-1] if is_other_way_round else names
    text, problems = table.flatness(known(**{dear: round(1000 * gate)}))
    assert not problems
    assert f"{dear} takes {gate:.3f} times {cheap}" in text
    assert table.flatness(known(**{dear: round(1000 * gate) + 1}))[1]


@pytest.mark.parametrize(("dearest", "verdict"), [(1150, "met"), (1151, "MISSED")])
def test_whether_steps_over_known_ground_differ_by_fifteen_percent_is_said(dearest, verdict):
    text, _ = table.flatness(known(**{"known/10000-weeds": dearest}))
    assert f"times known/40-weeds; target 1.15: {verdict}" in text


def test_a_program_that_is_to_be_compared_and_did_not_run_is_named():
    _, problems = table.flatness([one for one in known() if one.name != "wide/40-weeds"])
    assert problems == ["wide/40-weeds did not run, so wide/40-weeds and wide/10000-weeds cannot be compared"]


def test_the_table_reads_back_as_it_was_written(tmp_path):
    table.write(tmp_path / "counts.txt", counted(known_a=12, lap_b=3456), "a compiler")
    assert table.read(tmp_path / "counts.txt") == {"known/a": 12, "lap/b": 3456}
