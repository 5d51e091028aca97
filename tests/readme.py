"""Runs every `sh` and `python` block of a Markdown file, in order, and stops at the first failure."""

import re
import subprocess
import sys

blocks = re.findall(r"^```(sh|python)\n(.*?)^```", open(sys.argv[1], encoding="utf-8").read(), re.M | re.S)
assert blocks, "no blocks found"
shell = "set -euo pipefail\n"
for language, text in blocks:
    # One shell for all blocks, so that `export` in one holds in the next.
    if language == "python":
        text = f"python3 - <<'END_OF_BLOCK'\n{text}END_OF_BLOCK\n"
    shown = text.strip().replace("'", "'\\''")
    shell += f"printf '%s\\n' '--- {language}' '{shown}' '---'\n{text}"
sys.exit(subprocess.run(["bash", "-c", shell]).returncode)
