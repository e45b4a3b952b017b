"""A figure for a paper: two designs in one chart of one column's width, with labels and a legend, as a PDF.

`plot` draws into the axes that it is given and returns them, and all of matplotlib applies from there. Regions are
arrays of [K, B], so that another design is laid over the first one as a line. The circle is the stiffest wall.
"""

from matplotlib import pyplot

import zwidth

device = zwidth.load("published-two-mass")
charts = [device.with_({"loop.sampling_period_s": T}).chart() for T in (0.001, 0.00125)]
gain = charts[0].stiffness_max / charts[1].stiffness_max
print(f"1 kHz renders {gain:.2f} times the stiffness of 800 Hz")


def figure():
    """One column wide, in letters of 8 points."""
    with pyplot.rc_context({"font.size": 8.0}):
        ax = pyplot.subplots(figsize=(3.5, 2.5), layout="constrained")[1]
        filled = charts[0].plot(ax).patches[0]
        (dashed,) = ax.plot(*charts[1].regions[0].T, "k--")
        ax.legend([filled, dashed], ["sampled at 1 kHz", "sampled at 800 Hz"], frameon=False)
    return ax


if __name__ == "__main__":
    pyplot.rcParams["pdf.fonttype"] = 42  # letters stay letters, as publishers ask
    figure().figure.savefig("first_10_a_figure_for_a_paper.pdf")
