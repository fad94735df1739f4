"""Where results are written: into the file that a path leads to, and as a whole."""

import os
import threading

import pytest

from swath.files import write_whole


def test_a_file_is_replaced_as_a_whole_and_nothing_is_left_beside_it(tmp_path):
    (tmp_path / "rows.csv").write_text("older and longer")
    write_whole(tmp_path / "rows.csv", "new")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("rows.csv", "new")]


@pytest.mark.parametrize("is_there", [True, False])
def test_a_link_stays_one_and_the_file_that_it_leads_to_is_written(tmp_path, is_there):
    (tmp_path / "elsewhere").mkdir()
    target, link = tmp_path / "elsewhere" / "rows.csv", tmp_path / "link.csv"
    if is_there:
        target.write_text("old")
    link.symlink_to(target)
    write_whole(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert [path.name for path in (tmp_path / "elsewhere").iterdir()] == ["rows.csv"]


def test_a_pipe_is_written_as_it_is(tmp_path):
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    write_whole(pipe, "new")
    reader.join(10)
    assert read == ["new"]
    assert pipe.is_fifo()


def test_what_a_device_refuses_is_told_and_the_device_stays(tmp_path):
    link = tmp_path / "link"
    link.symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left on device"):
        write_whole(link, "x" * 100_000)
    assert link.resolve().is_char_device()
