"""A process beside this one has this vidtrack, wherever it runs."""

import subprocess
from pathlib import Path

import vidtrack
from vidtrack.beside import python


def test_a_process_beside_imports_this_vidtrack_and_not_one_of_its_folder(tmp_path: Path) -> None:
    (tmp_path / "vidtrack").mkdir()
    (tmp_path / "vidtrack" / "__init__.py").write_text("raise SystemExit('another vidtrack')")
    run = subprocess.run(
        python("import vidtrack; print(vidtrack.__file__)"), cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == vidtrack.__file__
