"""The memory of a program that embeds the estimator and brings its own images: no reader of recordings, no tools.

test_memory.py PROGRAM: runs it, and compares its largest resident size, libraries included, with what small boards can give.
"""

import resource
import subprocess
import sys

LIMIT_MB = 60.0


def main():
    subprocess.run([sys.argv[1]], check=True, stdout=subprocess.DEVNULL)
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
    print(f"{peak_mb:.1f} MB resident at most")
    if not 1.0 < peak_mb < LIMIT_MB:
        sys.exit(f"expected less than {LIMIT_MB:g} MB")


if __name__ == "__main__":
    main()
