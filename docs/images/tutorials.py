"""Takes the tutorials' pictures by following them: ``python docs/images/tutorials.py`` (needs Chromium)."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "_ext"))

from steps import follow, steps  # noqa: E402

SIZE = (1240, 900)
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def followed(page: str, folder: Path) -> None:
    """Do all that a tutorial says in a new folder."""
    folder.mkdir()
    for step in steps(HERE.parent / "tutorials" / page):
        follow(step, folder)


def main() -> None:
    """Follow both tutorials and keep what they draw."""
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        sys.exit("the pictures need Chromium")
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        followed("ten-minutes.md", place / "minutes")
        followed("bench.md", place / "bench")
        shot = place / "shot.png"
        window = ["--headless", "--no-sandbox", "--hide-scrollbars", f"--window-size={SIZE[0]},{SIZE[1]}"]
        report = (place / "bench" / "found" / "report.html").as_uri()
        subprocess.run([browser, *window, f"--screenshot={shot}", report], check=True, capture_output=True)
        pictures = {"ten_minutes_run": place / "minutes" / "logs" / "joint.png", "bench_report": shot}
        for stem, drawn in pictures.items():
            image = HERE / f"{stem}.webp"
            Image.open(drawn).convert("RGB").save(image, quality=85, method=6)
            print(image)


if __name__ == "__main__":
    main()
