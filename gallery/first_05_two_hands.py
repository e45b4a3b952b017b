"""Two hands: the walls of one device in a firm grasp, in a hand without mass, ungripped, and for all at once.

An operator is a mass, springs and dampers at the handle; two come with the package. A wall for everybody has to be
stable with each of them and ungripped: the robust chart is what the charts have in common, and says who sets
each part of its edge. In the corner where two meet, the common limit lies below that of each.
"""

import zwidth

device = zwidth.load("hapkit-course", {"loop.delay_samples": 1})
hands = ("none", "thesis-arm", "course-hand")
charts = [device.at(operator=hand).chart() for hand in hands]
for hand, chart in zip(hands, charts, strict=True):
    print(f"{hand}: {chart.stiffness_max:.1f} N/m")

family = zwidth.study.Family(device, ranges=(), operators=hands, operating_point=device.at())
study = zwidth.robust_study(family)
both = study.chart
who = " and ".join(hands[k] for k in both.members_at_stiffness_max)
print(f"all: {both.stiffness_max:.1f} N/m at {both.damping_at_stiffness_max:.2f} N s/m, set by {who}")


def figure():
    """The walls for everybody, and who sets each part of their edge."""
    return study.plot()


if __name__ == "__main__":
    figure().figure.savefig("first_05_two_hands.png")
