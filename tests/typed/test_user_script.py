"""The script in which pyright is strict answers as it stands."""

import runpy
from pathlib import Path


def test_the_script_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = runpy.run_path(str(Path(__file__).with_name("user_script.py")))
    assert (tmp_path / "a.png").is_file()
    assert not names["result"].status.is_bad
