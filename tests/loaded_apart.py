"""A device under load, from its nonlinear statics and its nonlinear computer: the judge of its linearisation.

The links' forces, the springs' torques and the computer's commands are written down as functions of where joints
and motors are, by the kinematics of `joints_apart`; their derivatives are differences of fourth order, and the map
from one sample to the next is put together by matrix exponentials. None of the package's second derivatives is
used. Masses and dampers are those of the unloaded plant, which tests of their own judge.

`SimulatedDevice` goes without that last step: the mechanism moves by its full equations of motion, integrated by
Runge and Kutta, and the map itself is differentiated. It takes longer, and knows drives on joints of their own
only.

Coordinates: the independent joints p, then theta of the flexible drives' motors, both as distances from where they
are in equilibrium. State: these, their rates, torques that lag, dampers' torques that lag; then the computer's:
torques on their way, the last reading, the filters' memories.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag, expm, matrix_balance
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from tests.model.joints_apart import FOURTH, Joints, travel, travel_rates
from zwidth.contact.mechanism.motion_kernel import set_passive_rates
from zwidth.contact.mechanism.stepping import accelerate, configure
from zwidth.contact.mechanism.system import motion_memory, system_of
from zwidth.loop import Butterworth
from zwidth.model import BALL_Z, GivenDamping, attach, pack, reduce_mechanism
from zwidth.model.effective_mass import screw

STEP = 5e-5  # of a joint, for differences [rad], [m]


def differences(function, size, step):
    """d function / d x (..., size) at x = 0, by differences of fourth order."""
    return np.stack([sum(w / step * function(s * step * e) for s, w in FOURTH) for e in np.eye(size)], axis=-1)


class LoadedDevice:
    """One point of a device under load, its computer included, at the wall K, B [N/m], [N s/m]."""

    def __init__(self, point, stiffness=0.0, damping=0.0):
        self.mechanism, self.controller, self.load = point.loaded_mechanism, point.controller, point.load
        self.K, self.B, self.links_counted = stiffness, damping, point.encoders == "link"
        self.screw, self.at = screw(point.direction), point.equilibrium
        self.wall_force = self.at.wall_force
        self.hand = self.at.hand_force, self.at.hand_moment
        drives = self.mechanism.drives
        self.ratio = np.asarray(drives.transmission)
        self.joints, self.q = Joints(self.mechanism), point.posture.angles
        self.here = self.joints.at(self.q)
        self.flexible = np.flatnonzero(np.isfinite(drives.stiffness))
        self.c, self.f, self.d = self.joints.count, len(self.flexible), len(drives.names)
        self.k = len(self.mechanism.driven)
        self.n = self.c + self.f
        self.bent = self.at.deflections[self.flexible]
        compensation = self.mechanism.gravity_compensation
        self.gravity = np.zeros(3) if compensation == "counterweight" else self.load.weight
        self.computes_gravity = compensation == "computed"
        self._take_matrices(point)
        self.lag = self.controller.actuator_time_constant
        self.lags = self.d if self.lag > 0.0 else 0
        self.whole, self.part = self.controller.whole_delay, self.controller.fractional_delay
        self.queue = self.whole + (self.part > 0.0)
        ahead = np.zeros(self.d)
        if not self.links_counted:
            ahead[self.flexible] = self.bent
        self.counted_at = ahead
        self.seen = self.joints.at(self.joints.moved(self.q, self.counted_motion(ahead)))
        self.ways = self._ways_of_the_force()
        T = self.controller.sampling_period
        self.low_passes = [
            _LowPass(self.controller.velocity_filter, T, 1),
            _LowPass(self.controller.force_filter, T, self.ways.shape[1]),
        ]

    def _take_matrices(self, point):
        """M and B (n, n) of joints and motors, dampers that lag, and what an operator adds to the stiffness."""
        m, drives = self.mechanism, self.mechanism.drives
        slope = differences(lambda d: self.springs(self.bent + d), self.f, 1e-4) if self.f else np.zeros((0, 0))
        self.tangent = np.diag(slope)
        k = np.full(self.d, np.inf)
        k[self.flexible] = self.tangent / self.ratio[self.flexible] ** 2
        bare = replace(m, drives=replace(drives, stiffness=k, ratio_tables=None))
        plant = reduce_mechanism(bare, point.posture, self.screw, "full", point.damping, point.encoders)
        held = plant if point.operator is None else attach(plant, point.operator)
        extra = held.size - plant.size  # the arm behind an elastic grasp
        to_drives = block_diag(pack(m).to_drive[0], np.eye(self.f + extra))
        own = np.pad(plant.stiffness, ((0, extra), (0, extra)))
        self.M, self.D = (to_drives.T @ each @ to_drives for each in (held.mass, held.damping))
        self.arm = to_drives.T @ (held.stiffness - own) @ to_drives
        self.extra = extra
        self.lagged = [(damper.along @ to_drives[: len(damper.along)], damper) for damper in held.lagged_dampers]

    def springs(self, bent):
        """Torques (f,) of the flexible drives' springs at the joint, at deflections (f,) of motor before joint, on
        the branch of each that it is on in equilibrium."""
        drives, n = self.mechanism.drives, self.ratio[self.flexible]
        k, dry = n**2 * drives.stiffness[self.flexible], drives.nonlinearity
        if dry is None:
            return k * bent
        back = n**2 * dry.backward_stiffness[self.flexible]
        kink = np.where(np.isfinite(back), -n * dry.preload[self.flexible] / k, 0.0)
        lags = (self.bent < kink) | ((self.bent == kink) & (self.load.branch == "backward"))
        slack = np.where(lags & np.isfinite(back), (back - k) * (bent - kink), 0.0)
        return k * bent + slack + n**4 * dry.hardening[self.flexible] * bent**3

    # --- the links --------------------------------------------------------------------------------------

    def travel(self, posed):
        """By what the drives' coordinates (d,) are ahead of those in equilibrium."""
        return travel(self.mechanism, self.q, posed.q, self.ratio)

    def travel_rates(self, posed):
        """Their derivative (d, c)."""
        return travel_rates(self.mechanism, posed, self.ratio)

    def forces(self, motion, torques):
        """Generalised forces (n,) on joints and motors at a motion (n,) of theirs, under motors' torques (d,)."""
        posed = self.joints.at(self.joints.moved(self.q, motion[: self.c]))
        _, speed, spin = self.here.handle if self.load.hand == "neglected" else posed.handle
        force, moment = self.hand
        if self.load.hand == "follower":
            link = self.mechanism.handle_link
            turn = posed.placed[0][link] @ self.here.placed[0][link].T
            force, moment = turn @ force, turn @ moment
        out = speed.T @ force + spin.T @ moment + posed.weight(self.gravity) + self.joint_springs(posed)
        sprung = self.springs(self.bent + motion[self.c : self.n] - self.travel(posed)[self.flexible])
        handed_on = torques.copy()
        handed_on[self.flexible] = sprung
        return np.concatenate([out + self.travel_rates(posed).T @ handed_on, torques[self.flexible] - sprung])

    def joint_springs(self, posed):
        """Torques (c,) of the joints' own springs: a free joint's is at rest where the assembly has it."""
        stiffness = self.mechanism.links.joint_stiffness
        if stiffness is None:
            return np.zeros(self.c)
        rest = self.q.copy()
        for i in self.mechanism.free:
            rest[i] = self.mechanism.assemblies[self.assembly][i]
        away = posed.q - rest
        for i in np.flatnonzero(self.mechanism.links.joint == BALL_Z):
            ball = slice(i - 2, i + 1)
            turn = Rotation.from_rotvec(rest[ball]).inv() * Rotation.from_rotvec(posed.q[ball])
            away[ball] = turn.as_rotvec()
        k = np.asarray(stiffness)[self.joints.moving]
        return -posed.B.T @ (k * away[self.joints.moving])

    @property
    def assembly(self):
        return next(iter(self.mechanism.assemblies))

    def _ways_of_the_force(self):
        """Orthonormal screws (6, m) that the wall's force is made of: the direction, and at a curved surface those
        that its normal turns towards."""
        u = self.screw / np.linalg.norm(self.screw)
        if not np.isfinite(self.load.surface_radius):
            return u[:, None]
        speed = self.seen.handle[1][:, : self.k]
        left, size, _ = np.linalg.svd(speed - np.outer(u[:3], u[:3] @ speed), full_matrices=False)
        across = left[:, size > 1e-9 * np.max(size)]
        return np.column_stack([u, np.vstack([across, np.zeros_like(across)])])

    # --- the computer -----------------------------------------------------------------------------------

    def counted_motion(self, counts):
        """The motion (c,) in which the drives' coordinates are nearest to counts (d,), free joints at rest."""
        motion = np.zeros(self.c)
        for _ in range(60):
            posed = self.joints.at(self.joints.moved(self.q, motion))
            T = self.travel_rates(posed)[:, : self.k]
            step = np.linalg.lstsq(T, counts - self.travel(posed), rcond=None)[0]
            motion[: self.k] += step
            if not np.max(np.abs(step)) > 1e-14:
                break
        return motion

    def reading(self, posed):
        """Way of the handle along the direction from where the computer sees it; about an axis its turn."""
        u, link = self.screw, self.mechanism.handle_link
        R = posed.placed[0][link] @ self.seen.placed[0][link].T
        turn = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
        return u[:3] @ (posed.handle[0] - self.seen.handle[0]) + u[3:] @ turn

    def normal(self, posed):
        """The screw (6,) along which the wall pushes: the surface's normal where the computer sees the handle."""
        R = self.load.surface_radius
        if not np.isfinite(R):
            return self.screw
        pressed = np.sign(self.wall_force) * self.screw[:3]
        out = posed.handle[0] - (self.seen.handle[0] - R * pressed)
        return np.append(np.sign(self.wall_force) * np.sign(R) * out / np.linalg.norm(out), np.zeros(3))

    def command(self, counts, memory):
        """The computer at a sample: torques (d,) and its memory's new values, from counts (d,) and memory."""
        posed = self.seen
        if np.any(counts):
            posed = self.joints.at(self.joints.moved(self.q, self.counted_motion(self.counted_at + counts)))
        y = self.reading(posed)
        last, speeds, forces = memory[0], *np.split(memory[1:], [self.low_passes[0].size])
        speed, speeds = self.low_passes[0].step(np.array([(y - last) / self.controller.sampling_period]), speeds)
        # the filter's memory is that of the force beyond the constant one
        constant, normal = self.wall_force * self.screw, self.normal(posed)
        wanted = (self.wall_force - self.K * y - self.B * speed[0]) * normal
        passed, forces = self.low_passes[1].step(self.ways.T @ (wanted - constant), forces)
        _, speed_of, spin_of = posed.handle
        pushed = np.concatenate([speed_of, spin_of]).T @ (constant + self.ways @ passed)
        if self.computes_gravity:
            pushed = pushed - posed.weight(self.gravity)
        T = self.travel_rates(posed)[:, : self.k]
        return np.linalg.pinv(T.T) @ pushed[: self.k], np.concatenate([[y], speeds, forces])

    @property
    def memory_size(self):
        return 1 + sum(low_pass.size for low_pass in self.low_passes)

    def counts(self, motion):
        """What is counted (d,) of a motion (n,), beyond what is counted in equilibrium."""
        ahead = self.travel(self.joints.at(self.joints.moved(self.q, motion[: self.c])))
        if not self.links_counted:
            ahead[self.flexible] = motion[self.c : self.n]
        return ahead

    # --- one sample -------------------------------------------------------------------------------------

    def unbalanced(self):
        """By what the forces on joints and motors, and the commanded torques, are off in equilibrium, as a share
        of the torques."""
        torques, _ = self.command(np.zeros(self.d), np.zeros(self.memory_size))
        off = np.concatenate([self.forces(np.zeros(self.n), torques), torques - self.at.torques])
        return np.max(np.abs(off)) / max(np.max(np.abs(torques)), 1e-6 * np.linalg.norm(np.concatenate(self.hand)))

    def flow(self):
        """x' = A x + G torques: A (N, N), G (N, d) on joints, motors, their rates, and torques that lag."""
        n, size = self.n, self.n + self.extra
        torques = self.at.torques
        K = np.pad(-differences(lambda x: self.forces(x, torques), n, STEP), ((0, self.extra), (0, self.extra)))
        pushed = np.zeros((size, self.d))
        pushed[:n] = np.stack([self.forces(np.zeros(n), torques + e) for e in np.eye(self.d)], axis=1)
        pushed[:n] -= self.forces(np.zeros(n), torques)[:, None]
        K = K + self.arm
        rates, lags = slice(size, 2 * size), slice(2 * size, 2 * size + self.lags)
        N = 2 * size + self.lags + len(self.lagged)
        A, G = np.zeros((N, N)), np.zeros((N, self.d))
        A[:size, rates], A[rates, :size], A[rates, rates] = np.eye(size), -K, -self.D
        if self.lags:
            A[rates, lags], A[lags, lags], G[lags] = pushed, -np.eye(self.d) / self.lag, np.eye(self.d) / self.lag
        else:
            G[rates] = pushed
        for i, (along, damper) in enumerate(self.lagged):
            own = 2 * size + self.lags + i
            A[rates, own], A[own, own] = -along, -1.0 / damper.time_constant
            A[own, rates] = damper.damping / damper.time_constant * along
        A[rates], G[rates] = np.linalg.solve(self.M, A[rates]), np.linalg.solve(self.M, G[rates])
        return A, G

    def jacobian(self):
        """d (state one sample later) / d state."""
        A, G = self.flow()
        N, T, d, waiting = len(A), self.controller.sampling_period, self.d, self.queue * self.d
        commands, memories = slice(N, N + waiting), slice(N + waiting, N + waiting + self.memory_size)
        size = N + waiting + self.memory_size
        counted = np.zeros((d, size))
        counted[:, : self.n] = differences(self.counts, self.n, STEP)
        still, empty = np.zeros(d), np.zeros(self.memory_size)
        by_counts = differences(lambda z: np.concatenate(self.command(z, empty)), d, STEP)
        by_memory = differences(lambda m: np.concatenate(self.command(still, m)), self.memory_size, 1.0)
        told = by_counts @ counted
        told[:, memories] += by_memory
        line = np.vstack([told[:d], np.eye(size)[commands]])  # newest first

        def at(place):
            return line[place * d : (place + 1) * d]

        L = np.eye(size)[:N]
        late = at(min(self.whole + 1, self.queue)), at(self.whole)
        for time, torques in zip((self.part * T, (1.0 - self.part) * T), late, strict=True):
            if time > 0.0:
                both = expm(np.block([[A, G], [np.zeros((d, N + d))]]) * time)
                L = both[:N, :N] @ L + both[:N, N:] @ torques
        return np.vstack([L, line[:waiting], told[d:]])


class SimulatedDevice(LoadedDevice):
    """The same, simulated from sample to sample by the equations of motion of `zwidth.contact`."""

    STEPS = 24  # of Runge and Kutta's method in a period: error far below the tolerance

    def __init__(self, point, stiffness=0.0, damping=0.0):
        super().__init__(point, stiffness, damping)
        m = self.mechanism
        nonlinear = reduce_mechanism(m, point.posture, self.screw, "full", GivenDamping()).nonlinear
        k = np.full(self.d, np.inf)
        k[self.flexible] = self.tangent / self.ratio[self.flexible] ** 2
        bare = replace(m, drives=replace(m.drives, stiffness=k))
        plant = reduce_mechanism(bare, point.posture, self.screw, "full", point.damping, point.encoders)
        plant = replace(plant, nonlinear=replace(nonlinear, friction=()))
        self.mech = pack(m)
        self.system = system_of(self.mech, m.drives, plant, self.gravity, self.lag)
        self.memory = motion_memory(self.system)
        self.base = np.concatenate(
            [self.q[m.drives.joint], (self.q[m.drives.joint] + self.at.deflections)[self.flexible]]
        )

    @property
    def size(self):
        return 2 * self.n + len(self.system.lag_time) + self.queue * self.d + self.memory_size

    def rate(self, x):
        """x' (N,) of the state beyond equilibrium."""
        full = x.copy()
        full[: self.n] += self.base
        assert configure(self.system, self.memory, full) >= 0.0
        hand = self.hand[0]
        if self.load.hand == "follower":
            link = self.mechanism.handle_link
            hand = self.memory.work.rotation[link] @ self.here.placed[0][link].T @ hand
        accelerate(self.system, self.memory, full, hand)
        return self.memory.rate.copy()

    def advance(self, x, time, torques):
        """The state after a time under held torques."""
        self.memory.hold[:], self.memory.command[:] = 0.0, 0.0
        follows = self.system.lag_command
        for i in np.flatnonzero(follows >= 0):
            self.memory.command[i] = torques[follows[i]]
        if not np.any(follows >= 0):
            self.memory.hold[self.system.motor] = torques
        steps = max(1, int(np.ceil(self.STEPS * time / self.controller.sampling_period)))
        h = time / steps
        for _ in range(steps if time > 0.0 else 0):
            a = self.rate(x)
            b = self.rate(x + h / 2 * a)
            c = self.rate(x + h / 2 * b)
            x = x + h / 6 * (a + 2 * b + 2 * c + self.rate(x + h * c))
        return x

    def map(self, state):
        """The state one sample later; of lagging torques and commands what is beyond those in equilibrium."""
        N, T = 2 * self.n + len(self.system.lag_time), self.controller.sampling_period
        lagging = 2 * self.n + np.flatnonzero(self.system.lag_command >= 0)
        x, waiting, memory = np.split(state, [N, N + self.queue * self.d])
        self.memory.angles[:] = self.q
        set_passive_rates(self.mech, self.memory.angles, self.memory.work)
        torques, memory = self.command(self.counts(x), memory)
        line = np.vstack([torques, self.at.torques + waiting.reshape(self.queue, self.d)])
        x = x.copy()
        x[lagging] += self.at.torques[: len(lagging)]
        x = self.advance(x, self.part * T, line[min(self.whole + 1, self.queue)])
        x = self.advance(x, (1.0 - self.part) * T, line[self.whole])
        x[lagging] -= self.at.torques[: len(lagging)]
        return np.concatenate([x, (line[: self.queue] - self.at.torques).ravel(), memory])

    def jacobian(self):
        """d map / d state, by differences in steps that suit each part."""
        N = 2 * self.n + len(self.system.lag_time)
        torque = max(np.max(np.abs(self.at.torques)), 1e-2)
        steps = np.full(self.size, 1e-3 * self.reading_size)
        step = min(1e-4, 0.2 * np.min(np.abs(self.bent), initial=1.0))  # springs stay on their branch
        steps[: self.n], steps[self.n : 2 * self.n] = step, step / self.controller.sampling_period
        steps[2 * self.n : N + self.queue * self.d] = 0.1 * torque
        columns = [
            sum(w / step * self.map(s * step * e) for s, w in FOURTH)
            for step, e in zip(steps, np.eye(self.size), strict=True)
        ]
        return np.array(columns).T

    @property
    def reading_size(self):
        return 1e-2 * float(np.linalg.norm(self.here.handle[1]))


class _LowPass:
    """A low pass of so many signals as a difference equation; without memory where there is none."""

    def __init__(self, low_pass, period, count):
        self.b, self.a, self.count = np.ones(1), np.ones(1), count
        if low_pass is not None:
            assert isinstance(low_pass, Butterworth)
            assert low_pass.order == 2
            u = np.pi * low_pass.cutoff_Hz * period  # the bilinear rule, not prewarped
            self.b = u * u * np.array([1.0, 2.0, 1.0])
            self.a = np.array(
                [1.0 + np.sqrt(2.0) * u + u * u, 2.0 * (u * u - 1.0), 1.0 - np.sqrt(2.0) * u + u * u]
            )

    @property
    def size(self):
        return self.count * (len(self.a) - 1)

    def step(self, signal, memory):
        """The filtered signal (count,), and the memory after it."""
        if not self.size:
            return signal, memory
        first, second = np.split(memory, 2)
        b, a = self.b / self.a[0], self.a / self.a[0]
        out = b[0] * signal + first
        return out, np.concatenate([b[1] * signal - a[1] * out + second, b[2] * signal - a[2] * out])


def root_errors(ours, judge, least=0.3, hidden=0):
    """How far our roots are from those of the judge's matrix above a least size, in two measures (r,) each.

    First the distance from the partner as a share of the root. Then the least change, as a share of the balanced
    matrix, that makes ours a root of the judge's matrix: what the errors of its differences have to explain. Roots
    that nearly coincide are known to the root of these errors, and their distance says little.

    hidden  how many roots of the judge's we leave out
    """
    theirs = np.linalg.eigvals(judge)
    big, mine = theirs[np.abs(theirs) > least], ours
    if hidden:
        mine = ours[np.abs(ours) > least]
        assert len(big) - len(mine) == hidden
    cost = np.abs(mine[None, :] - big[:, None])
    rows, columns = linear_sum_assignment(cost)
    assert len(rows) == len(big) - hidden, "the loop has fewer roots than the judge"
    balanced = matrix_balance(judge, permute=False)[0]
    size = np.linalg.norm(balanced, 2)
    distance = cost[rows, columns] / np.abs(big[rows])
    backward = np.array(
        [np.linalg.svd(balanced - z * np.eye(len(judge)), compute_uv=False)[-1] / size for z in mine[columns]]
    )
    return distance, backward
