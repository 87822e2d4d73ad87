"""Work over files of strangers, in a process that may compute and read, and nothing else."""

import pytest

import robostiff as rs
from robostiff.errors import Location
from robostiff.io.child_process import ProcessLimits, answer_of


def _asked(folder, script, limits=None):
    task = folder / "task.py"
    task.write_text("import ctypes, os, subprocess, socket\ndef answer(request):\n    " + script)
    limits = limits or ProcessLimits()
    return answer_of(task, {"n": 3}, Location("m.xml"), "MJCF", "MuJoCo", limits)


def test_a_child_process_answers(tmp_path):
    assert _asked(tmp_path, "return {'n': request['n'] + 1}") == {"n": 4}
    assert _asked(tmp_path, "print('noise'); return {}") == {}


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("while True: pass", "MuJoCo takes more than 1 s"),
        ("return {'x': 'a' * 10**10}", "more than 1000000000 bytes of memory"),
        ("ctypes.string_at(0)", "m.xml: MJCF: got a file at which MuJoCo fails"),
        ("os.abort()", "fails: exit status -6"),
        ("answer(request)", "circular or too deep nesting"),
        ("return {'refusal': 'a\\n  b'}", "got a b, expected what MuJoCo can read"),
        ("subprocess.run(['touch', 'x'])", "fails: PermissionError"),
        ("open('x', 'w')", "fails: PermissionError"),
        ("os.system('touch x')", "fails: PermissionError"),
        ("socket.socket()", "fails: PermissionError"),
        ("os.remove('m.xml')", "fails: PermissionError"),
    ],
)
def test_a_child_process_ends_in_one_message(script, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rs.FileError, match=message):
        _asked(tmp_path, script, ProcessLimits(memory=1_000_000_000, seconds=1))
    assert [path.name for path in tmp_path.iterdir()] == ["task.py"]
