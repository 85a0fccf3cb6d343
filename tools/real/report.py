"""The page docs/real-data.md from the results of `tools/real_data run`."""

from real.catalogue import DATA_SETS, HELD
from real.altered import table as altered_table
from real.judge import table
from real.miscalibrated import table as miscalibrated_table
from real.reference import table as reference_table

HEAD = """# Real recordings

What the estimator does on recordings that nobody here made, with the settings it ships with, and whether its health says so.
This page is written by `tools/real_data report`; do not edit it.

    tools/real_data list                       # which there are, with licence and source
    tools/real_data convert euroc MH_01_easy   # a local copy of the original to our layout
    tools/real_data run                        # all in ../shared/data, or those named, by name or folder
    tools/real_data alter                      # the same with something wrong in them (section below)
    tools/real_data miscalibrate               # the same with a calibration as wrong as on real rigs (section below)
    tools/real_data references                 # how good their truth is (section below)
    tools/real_data report

The figures are defined in [evaluation.md](evaluation.md), *far off* and *false tracking* in [its section](evaluation.md#false-tracking); positions are
aligned over the whole path for the ATE, over the first pose for NEES, and over the first two seconds for the rest. *Alarms per hour*: how often the health
left `tracking` for `degraded` or `lost` while the position was not far off, over the recording's length; *others than imprecise*: those that say more than
that the position is less certain than 5 % of the path. The sensors are taken for sound, so these count as false alarms; where they are not, the notes say so.
One alarm in 20 s makes 180 per hour. *Truth to*: smaller errors are not judged. "-": no estimate, or no such truth.
"""


def lines_of(text, width=158):
    """Words in lines that fit."""
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) + 1 > width:
            lines.append("")
        lines[-1] += (" " if lines[-1] else "") + word
    return lines


def bullet(text):
    first, *rest = lines_of(text, 156)
    return "\n".join(["- " + first, *("  " + line for line in rest)])


def notes(results):
    for result in results:
        name, figures = result["name"], result["figures"]
        text = f"**{name}**: {HELD[name].what}. {HELD[name].note[0].upper()}{HELD[name].note[1:]}." if name in HELD else ""
        if result["error"]:
            text += f" No estimate: \"{result['error']}\"."
        elif figures is None:
            text += " There is no truth."
        elif figures["false_tracking"]["percent"] > 0.0:
            worst = max(figures["false_tracking"]["stretches"], key=lambda s: s["tracking_s"])
            text += (f" Longest false tracking: {worst['tracking_s']:.1f} s, up to {worst['largest_error_m']:.2f} m off after "
                     f"{worst['travelled_m']:.0f} m, {worst['most_sigmas']:.1f} standard deviations.")
        if text:
            yield bullet(text if name in HELD else f"**{name}**:{text}")


def data_sets():
    lines = ["| data set | what | here | licence, as far as known | source | `convert` |", "|---|---|---|---|---|---|"]
    for d in DATA_SETS:
        source = f"<{d.source}>" if "://" in d.source else d.source
        lines.append(f"| {d.name} | {d.what} | {d.fit} | {d.licence} | {source} | {'yes' if d.converter else 'no'} |")
    return "\n".join(lines)


ALTERED = """## Altered

The same recordings with something wrong in them: `tools/real_data alter`. ATE [m], and in bold for how much of the time the health says `tracking` while
the position is far off. "none": no estimate, with a reason in words; empty: the recording lacks the sensor; "-": nothing to compare with.
"""


MISCALIBRATED = """## Calibration as wrong as on real rigs

`tools/real_data miscalibrate`: 20 draws of errors in everything that sensor.yaml says of cameras, wheels and beams, and in their clocks, with the standard
deviations of [`--calibration-error 1`](simulator.md). The calibration of `hop` is exact as it is; to those of the others these errors are added.
"""


REFERENCES = """## How good the truths are

`tools/real_data references` judges each truth by the recording's own inertial samples and by itself; no estimate is in it. How much turns over a second
differ from the gyroscope's, its bias taken out; by how much the positions and the truth's own velocities contradict each other over the worst second; by how
much later the positions are than the accelerometer, integrated twice over 0.3 s with gravity, bias and a lever fitted, and what is then left. `hop` is
simulated: its row shows what the inertial samples' noise does. "-": no velocities, or gaps. What it means for the figures above:
[decision 31](decisions/0031-priors-as-real-sensors-are.md).
"""


def page(results, altered=None, miscalibrated=None, references=None):
    return "\n".join([HEAD, table([(r["name"], r["figures"]) for r in results]), "", *notes(results), "",
                      *([ALTERED, altered_table(altered["results"], altered["names"]), ""] if altered else []),
                      *([MISCALIBRATED, miscalibrated_table(miscalibrated), ""] if miscalibrated else []),
                      *([REFERENCES, reference_table(references), ""] if references else []), "## Data sets", "", data_sets(), "",
                      *lines_of("The converters read every row and name file, line and field of what is wrong; images are linked, not "
                                "copied. That of comma2k19 makes, of the example segment in its repository, the recording above: the same "
                                "samples and truth, and counts that are at most one off. That of kitti_raw has calibrations as above, but "
                                "was not run on a whole drive. What no converter could make without guessing (noise of the IMU, the odometer's "
                                "mounting) is named in the sensor.yaml files."), ""])
