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


@pytest.mark.parametrize(("dearest", "is_refused"), [(1150, False), (1151, True)])
@pytest.mark.parametrize(
    "cheap_and_dear", [(cheap, dear) for pair in table.ALIKE for cheap, dear in (pair, pair[::-1])]
)
def test_steps_over_known_ground_may_not_differ_by_more_than_fifteen_percent(cheap_and_dear, dearest, is_refused):
    cheap, dear = cheap_and_dear
    instructions = dict.fromkeys((name for pair in table.ALIKE for name in pair), 1000) | {dear: dearest}
    text, problems = table.flatness([Counted(name, 1, "step", Profile(total)) for name, total in instructions.items()])
    assert bool(problems) == is_refused
    assert f"{dear} takes {dearest / 1000:.3f} times {cheap}" in text


def test_the_table_reads_back_as_it_was_written(tmp_path):
    table.write(tmp_path / "counts.txt", counted(known_a=12, lap_b=3456), "a compiler")
    assert table.read(tmp_path / "counts.txt") == {"known/a": 12, "lap/b": 3456}
