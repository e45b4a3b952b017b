"""A contact: a hand pushes the device into a one-sided wall, and where the energy goes.

The run starts at rest 1 mm outside, with a push of 2 N. The ledger says what each has put in by its end, negative
for what was taken out: the hand pays for what the wall and the structure take, and a force that is held between
samples adds a part of its own. What is left is what arm and device have stored.
"""

import zwidth

point = zwidth.load("published-two-mass", operator="thesis-arm").at()
contact = point.simulate(stiffness=4000.0, damping=10.0, wall="one-sided", push=2.0)
print(f"{contact.behaviour}: at rest {1e3 * contact.position[-1]:.3f} mm inside, {contact.force[-1]:.3f} N")

for name in ("hand", "wall", "hold", "velocity estimate", "structure"):
    print(f"{name}: {1e3 * contact.ledger[name]:+.3f} mJ")
print(f"all together {1e3 * sum(contact.ledger.values()):.3f} mJ, stored {1e3 * contact.energy[-1]:.3f} mJ")


def figure():
    """The reading over time."""
    return contact.plot()


if __name__ == "__main__":
    figure().figure.savefig("first_08_a_contact.png")
