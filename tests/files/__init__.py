"""Model files and descriptions of robots that tests read, each as a file of its own."""

from pathlib import Path

FILES = Path(__file__).parent


def text_of(name: str) -> str:
    """What a file has, for tests that change some of it."""
    return (FILES / name).read_text(encoding="utf-8")


def written(file: Path, text: str) -> Path:
    """The file, which then has this text."""
    file.write_text(text, encoding="utf-8")
    return file
