"""The two-mass wall with friction, encoder and force limit, simulated as a competent user would otherwise.

One plant in all of them: link and motor on a spring and a damper, Coulomb friction on the motor, whose encoder
counts in steps; the motor's force is limited. The wall's force is computed once per period from the reading.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, floor

import numpy as np


@dataclass(frozen=True)
class TwoMassDevice:
    """link, motor [kg]; drive stiffness [N/m] and damping [N s/m]; friction, limit [N]; step [m]; period [s]."""

    link: float
    motor: float
    stiffness: float
    damping: float
    friction: float
    step: float
    limit: float
    period: float

    def force(self, reading: float, before: float, K: float, B: float) -> float:
        """Force that the computer commands, within the limit [N]."""
        command = -(K * reading + B * (reading - before) / self.period)
        return min(max(command, -self.limit), self.limit)

    def quantised(self, place: float) -> float:
        """Position as the encoder reads it, a whole number of steps [m]."""
        return self.step * floor(place / self.step + 0.5)


def by_mujoco(bench: TwoMassDevice, K: float, B: float, start: float, samples: int, substeps: int = 20):
    """Readings of the motor (samples,), and the seconds it took to step.

    The link rides on the motor, on a slide joint that has the drive's spring and damper; friction is the joint's
    frictionloss, as hard as the step allows. One call of mj_step for the substeps of a period.
    """
    from time import perf_counter

    import mujoco

    h = bench.period / substeps
    model = mujoco.MjModel.from_xml_string(
        f"""
        <mujoco>
          <option timestep="{h:.17g}" gravity="0 0 0" integrator="implicitfast">
            <flag contact="disable" equality="disable" limit="disable" sensor="disable"/>
          </option>
          <worldbody>
            <body name="motor">
              <joint name="motor" type="slide" axis="1 0 0" frictionloss="{bench.friction}"
                     solreffriction="{2.0 * h:.17g} 1" solimpfriction="0.999 0.9999 0.001 0.5 2"/>
              <inertial pos="0 0 0" mass="{bench.motor}" diaginertia="1e-6 1e-6 1e-6"/>
              <body name="link">
                <joint name="drive" type="slide" axis="1 0 0" stiffness="{bench.stiffness}"
                       damping="{bench.damping}"/>
                <inertial pos="0 0 0" mass="{bench.link}" diaginertia="1e-6 1e-6 1e-6"/>
              </body>
            </body>
          </worldbody>
          <actuator><motor joint="motor" ctrllimited="true" ctrlrange="{-bench.limit} {bench.limit}"/></actuator>
        </mujoco>
        """
    )
    data = mujoco.MjData(model)
    data.qpos[0] = start
    readings = np.empty(samples)
    place, control = data.qpos, data.ctrl
    before = bench.quantised(start)
    begun = perf_counter()
    for j in range(samples):
        readings[j] = place[0]
        reading = bench.quantised(place[0])
        control[0] = bench.force(reading, before, K, B)
        before = reading
        mujoco.mj_step(model, data, nstep=substeps)
    return readings, perf_counter() - begun


def by_events(bench: TwoMassDevice, K: float, B: float, start: float, samples: int):
    """The same by scipy's solve_ivp, from one change between sticking and sliding to the next."""
    from time import perf_counter

    from scipy.integrate import solve_ivp

    m1, m2, k, b, C = bench.link, bench.motor, bench.stiffness, bench.damping, bench.friction

    def push(s, force):
        return k * (s[0] - s[1]) + b * (s[2] - s[3]) + force

    def slide(t, s, force, side):
        drive = k * (s[0] - s[1]) + b * (s[2] - s[3])
        return [s[2], s[3], -drive / m1, (drive + force - side * C) / m2]

    def stick(t, s, force, side):
        return [s[2], 0.0, -(k * (s[0] - s[1]) + b * s[2]) / m1, 0.0]

    def stops(t, s, force, side):
        return side * s[3] + 1e-12

    def starts(t, s, force, side):
        return C - abs(push(s, force))

    stops.terminal, stops.direction = True, -1.0
    starts.terminal, starts.direction = True, -1.0
    s, before = np.array([start, start, 0.0, 0.0]), bench.quantised(start)
    readings = np.empty(samples)
    begun = perf_counter()
    for j in range(samples):
        readings[j] = s[1]
        reading = bench.quantised(s[1])
        force = bench.force(reading, before, K, B)
        before, t, forced = reading, 0.0, 0.0
        while t < bench.period:
            total = push(s, force)
            side = copysign(1.0, s[3]) if abs(s[3]) > 1e-11 else forced or copysign(1.0, total) * (abs(total) > C)
            if side == 0.0:
                s[3] = 0.0
            way, event = (slide, stops) if side else (stick, starts)
            solution = solve_ivp(
                way,
                (t, bench.period),
                s,
                method="DOP853",
                rtol=1e-8,
                atol=1e-12,
                events=event,
                args=(force, side),
                max_step=bench.period / 4.0,
            )
            s, t = solution.y[:, -1].copy(), solution.t[-1]
            forced = 0.0
            if solution.status == 1:
                if side:
                    s[3] = 0.0
                else:
                    forced = copysign(1.0, push(s, force))
    return readings, perf_counter() - begun
