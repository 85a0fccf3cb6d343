"""Debian's chromium, led by playwright-core from npm's registry."""

import os
import shutil
import subprocess


def browser_or_reason(scripts, scratch):
    """Copies the scripts, and what package.json beside them names, to `scratch`: the environment to run them in with
    node there, or None and the reason why there is no browser."""
    chromium = shutil.which("chromium")
    if not chromium:
        return None, "no chromium here; Debian's package chromium"
    if not shutil.which("npm") or not shutil.which("node"):
        return None, "no Node.js and npm here"
    shutil.copytree(scripts, scratch, dirs_exist_ok=True)
    if not (scratch / "node_modules/playwright-core").is_dir():
        try:
            done = subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=scratch,
                                  stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=240)
        except subprocess.TimeoutExpired:
            return None, "npm's registry does not answer"
        if done.returncode != 0:
            return None, "npm could not install playwright-core: " + done.stderr[-300:]
    return {**os.environ, "CHROMIUM": chromium}, ""
