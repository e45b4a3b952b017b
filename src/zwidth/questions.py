"""The arguments of every question: name, unit, range, default and one sentence of each, stated once.

Methods and functions state name and default in their signatures and the sentence in their docstrings, which a test
compares; the command line makes its options of these tables, study files and the page take ranges from them, and
`docs/commands.md` its tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from math import inf
from typing import Final

from zwidth.argument import LARGEST, Argument, Arguments, by_name

_number = partial(Argument, value="NUMBER")
_whole = partial(Argument, kind="whole", least=0, most=inf, value="N")
_choice = partial(Argument, kind="choice")
_flag = partial(Argument, kind="flag", default=False)
_vector = partial(Argument, kind="vector")
_counts = partial(Argument, kind="counts")
_text = partial(Argument, kind="text", value="NAME")

# The tables are packed by hand, an argument in as few lines as it fits.
# fmt: off

# --- the device, its posture, and how a long run is computed ------------------------------------------

SETTINGS: Final = _text(
    "settings", "Change a number of the device file; PATH=unset removes it", value="PATH=VALUE", option="set",
    repeated=True,
)
LOADS: Final = by_name(
    _vector(
        "load", "Force of the hand on the handle [N], about an axis its moment [N m], under which the device is "
        "linearised", "N", value="FX,FY[,FZ]", lengths=(2, 3), example="0,-5", left_out="the [load] of DEVICE",
    ),
    _vector(
        "gravity", "Gravity", "m/s²", value="GX,GY[,GZ]", lengths=(2, 3), example="0,0,-9.81",
        left_out="the [load] of DEVICE",
    ),
)
PLACE: Final = by_name(
    _vector(
        "at", "Posture: the handle's position [m], or the driven joints' angles [rad]",
        value="X,Y[,Z]|JOINT=RAD,...", lengths=(2, 3), example="0.1,0.25",
    ),
    _vector(
        "direction", "Rendered direction, a vector of any length", value="DX,DY[,DZ]", lengths=(2, 3),
        example="0,1",
    ),
    _vector(
        "axis", "Axis about which moments are rendered, of any length; walls then are in N m/rad. With a "
        "direction: a screw", value="AX,AY,AZ", lengths=(3,), example="0,0,1",
    ),
    _number("characteristic_length", "Length by which angles count as ways on a screw", "m", value="METRES"),
    _vector(
        "orientation", "Orientation of the handle [rad], where the drives control it", "rad",
        value="ROLL,PITCH,YAW", lengths=(3,), example="0,0,1.57",
    ),
)
DEVICE: Final = by_name(
    _text("assembly", "Way of assembling the mechanism"),
    _choice(
        "model", "How much of the device is modelled", choices=("full", "two-mass", "motor-mass", "rigid"),
        left_out="full; a [plant] as it is given",
    ),
    _text(
        "operator", "Who holds the handle: a bundled operator, a file with an [operator], or nobody",
        value="NAME|FILE|none", left_out="the [operator] of DEVICE",
    ),
    SETTINGS,
)

RUN: Final = by_name(
    _text(
        "store", "Keep finished work in this folder; the same command continues from it", value="FOLDER",
        option="resume",
    ),
    _whole("workers", "Largest number of processes", least=1, left_out="one for each core"),
    _text(
        "cluster", "Compute on the dask cluster whose scheduler has this address, such as tcp://192.168.1.5:8786, "
        "or 'local' for one on this computer", value="ADDRESS",
    ),
    _number(
        "time_limit", "Time after which a design or cell is given up [s], to within a second: it is 'out of "
        "time', the others keep their values", "s", above=0.0, value="SECONDS", hint="leave it out for none",
    ),
    _choice(
        "processor", "Where charts are computed; cuda: on an NVIDIA GPU", choices=("cpu", "cuda"), default="cpu",
    ),
)

# --- walls, and what measures are told of them --------------------------------------------------------

_STIFFNESS = _number("stiffness", "Stiffness of the wall", "N/m", value="K")
_DAMPING = _number("damping", "Damping of the wall", "N s/m", value="B")
WALL: Final = by_name(replace(_STIFFNESS, required=True), replace(_DAMPING, required=True))
DIRECTIONS: Final = by_name(
    _vector(
        "directions", "Another direction of the same wall, as in a corner", value="DX,DY[,DZ]", lengths=(2, 3),
        example="1,0", option="with-direction", repeated=True,
    ),
    _text(
        "relative_stiffness", "Stiffness along these directions, in their order; only ratios count", value=None,
        left_out="the same along all",
    ),
    _text("relative_damping", "Damping along these directions", value=None, left_out="as the stiffness"),
)
WANTED: Final = by_name(
    _number("stiffness", "Stiffness of the wanted wall", "N/m", least=0.0, value="K", key="stiffness_N_per_m"),
    _number("damping", "Damping of the wanted wall", "N s/m", least=0.0, value="B", key="damping_Ns_per_m"),
    _number("frequency", "Frequency at which the hand moves", "Hz", above=0.0, value="F", key="frequency_Hz"),
    _number(
        "spectral_radius", "Spectral radius that the wall must not exceed: vibration shrinks at least by it per "
        "sample", above=0.0, most=1.0, key="spectral_radius",
    ),
    _number(
        "stiffness_margin", "Share by which the wall's stiffness may be off", least=0.0, key="stiffness_margin",
    ),
    _number("damping_margin", "Share by which the wall's damping may be off", least=0.0, key="damping_margin"),
    _number(
        "delay_margin", "How much longer the delay may be", "samples", least=0.0, most=20.0,
        key="delay_margin_samples",
    ),
    _number("lowest_frequency", "Lower end of the band of motion", "Hz", above=0.0, key="lowest_frequency_Hz"),
    _number("highest_frequency", "Upper end of the band of motion", "Hz", above=0.0, key="highest_frequency_Hz"),
    _number("force", "Force to be held along the rendered direction", "N", least=0.0, key="force_N"),
    _number(
        "link_radius", "Radius of the links, taken for rods with round ends", "m", least=0.0, key="link_radius_m",
    ),
)
WANTED_BY_KEY: Final = {one.key: one for one in WANTED.values()}

# --- the questions, by their commands -----------------------------------------------------------------

CHART: Final = by_name(
    _vector(
        "window", "Part of the chart that a figure shows; results are never clipped", value="KMIN,KMAX,BMIN,BMAX",
        lengths=(4,), example="0,8000,0,30",
    ),
    *DIRECTIONS.values(),
)
CHECK: Final = by_name(
    _text("points", "File of walls: columns stiffness_N_per_m, damping_Ns_per_m", value="FILE.csv"),
    replace(_STIFFNESS, sentence="Stiffness of one wall"),
    replace(_DAMPING, sentence="Damping of one wall"),
    *DIRECTIONS.values(),
)
POLAR: Final = by_name(
    _choice(
        "plane", "Plane of the directions", choices=("xy", "xz", "yz"),
        left_out="xy, or, where the handle cannot move in all of it, a plane in which it can",
    ),
    _whole("count", "Number of directions, spread evenly over the full turn", default=72, least=3, most=3600),
)
LOAD: Final = by_name(
    _number(
        "push", "Largest push to either side [N], about an axis [N m]", "N", default=5.0, above=0.0, value="F",
        hint="pushes to both sides are charted",
    ),
    _whole("count", "Number of pushes, odd", default=9, least=3, most=201),
)
BOUNDS: Final = by_name(
    replace(
        _DAMPING, sentence="Damping at which the conditions are compared",
        left_out="that of the stiffest stable wall; 0 if there is none",
    ),
)
GUARANTEES: Final = by_name(
    _flag(
        "coupling", "Also find the virtual couplings that keep the device stable with every passive wall and "
        "operator (Llewellyn), or make it passive (Raisbeck)",
    ),
    replace(_STIFFNESS, sentence="Stiffness of the wall that the coupling renders", above=0.0),
    replace(_DAMPING, sentence="Damping of the wall that the coupling renders", left_out="0"),
)
SENSITIVITY: Final = by_name(
    _whole("top", "Rows of the printed table, and bars of the figure", default=12, least=1),
    _number(
        "goal", "Also find what each number would have to be for this largest stiffness", "N/m", above=0.0,
        value="K",
    ),
)
_SEED = _whole("seed", "Seed of the random numbers", default=1)
_NOISE_SEED = _whole("seed", "Seed of the encoders' noise", default=0, most=2**63 - 1)
ROBUST: Final = by_name(
    _text(
        "ranges", "A number of the device file that is known within two values; log: samples are spread evenly "
        "over its logarithm", value="PATH=LOW,HIGH[,log]", option="range", repeated=True,
    ),
    _text("operators", "Operators that may hold the handle: names, files, none", value="A,B,C"),
    _text(
        "operator_list", "File of operators that may hold the handle, one per line; # begins a comment",
        value="FILE",
    ),
    _whole(
        "members", "Largest number of members charted", least=2, most=100_000,
        left_out="256; of a measured response 24",
    ),
    _whole(
        "unseen", "Number of random members tried afterwards", least=1, most=100_000,
        left_out="10000; of a measured response 200",
    ),
    _SEED,
)
TOLERANCE: Final = by_name(
    _whole("samples", "Devices drawn", least=1, most=10**9, left_out="1000"),
    _whole(
        "index_samples", "Base samples of the sensitivity indices, a power of 2 from 32 on, 0 for none",
        most=65536, left_out="512",
    ),
    replace(_SEED, default=None, left_out="1"),
)

MAP: Final = by_name(
    _text("measures", "Measure to map", option="measure", repeated=True),
    _text("measures_file", "File with measures of your own", value="FILE.py"),
    _vector(
        "plane", "Plane of the map, by two vectors in it", value="xy|xz|yz|AX,AY,AZ,BX,BY,BZ", lengths=(6,),
        example="1,0,0,0,0,1, or xy, xz, yz", left_out="the plane that the handle cannot leave, or xy",
        key="plane",
    ),
    _vector(
        "through", "A point of the plane", "m", value="X,Y[,Z]", lengths=(2, 3), example="0,0.25",
        left_out="the reference position", key="through_m",
    ),
    *(
        _vector(
            f"{name}_range", f"Lowest and highest coordinate along the plane's {which} axis", "m",
            value="LOW,HIGH", lengths=(2,), example="-0.2,0.2", option=f"{name}", key=f"{name}_m",
            left_out="the workspace of the device file, or the reachable range",
        )
        for name, which in (("x", "first"), ("y", "second"))
    ),
    _counts(
        "cells", "Number of cells along both axes", value="NX,NY", lengths=(2,), example="81,41",
        left_out="81 along the longer one",
    ),
    _text(
        "requirements", "Requirement, with >= or <=: show where it is met, and where all are", value="NAME>=VALUE",
        option="require", repeated=True,
    ),
    _text(
        "shares", "Requirement, with >= or <=: map the share of directions that meet it", value="NAME>=VALUE",
        option="share", repeated=True,
    ),
    # walls of either sign have spectral radii, too
    *(replace(one, least=-LARGEST) if one.value in ("K", "B") else one for one in WANTED.values()),
    _text(
        "colliding_links", "Links that can collide, for link_clearance", value="A:B", repeated=True,
        left_out="all that are no neighbours",
    ),
)
EXPORT: Final = by_name(
    *(
        _vector(
            f"{name}_range", f"Lowest and highest coordinate of the table along {name}", "m", value="LOW,HIGH",
            lengths=(2,), example="-0.1,0.1", option=f"{name}",
            left_out="the workspace of DEVICE, or the reachable range",
        )
        for name in "xyz"
    ),
    _counts(
        "cells", "Number of cells along each axis", value="NX,NY[,NZ]", lengths=(2, 3), example="20,10",
        left_out="20 along the longer side of a plane, 6 in space",
    ),
    _text(
        "hands", "Operators that may hold the handle: bundled ones, files, none", value="A,B,C",
        left_out="that of DEVICE",
    ),
    _number(
        "margin", "Share by which stiffness and damping may both be off", default=0.0, least=0.0, below=1.0,
        value="SHARE",
    ),
    _whole("levels", "Bands of stiffness in each cell", default=12, least=1, most=255),
    _whole(
        "directions", "Further tables for sectors of directions: 2 N in a plane, 3 N² in space; 1: none",
        default=1, least=1, most=16,
    ),
    _number(
        "span", "Damping range that every cell offers at least [N s/m]: the stiffest walls that have it", "N s/m",
        above=0.0, value="B", left_out="the walls whose rectangle is the largest",
    ),
    _whole("size_limit", "Refuse a table that takes more bytes", least=1, value="BYTES"),
    _text("arduino", "Also write a sketch that clamps its gains by the table, with the header", value="FOLDER"),
    replace(_SEED, sentence="Seed of the random postures that cells are tried by"),
)
OPTIMISE: Final = by_name(
    _text(
        "designs", "Write a device file for each design of the front into this folder, replacing earlier ones",
        value="FOLDER",
    ),
)

ENVIRONMENT: Final = by_name(
    _text(
        "environment", "An environment instead of a wall: a bundled one, or one from a file of your own",
        value="NAME|FILE.py:NAME",
    ),
    _text("parameters", "A parameter of the environment", value="NAME=VALUE", option="parameter", repeated=True),
)
_PLACE = partial(_number, unit="m", least=-1e3, most=1e3, value="M")
SIMULATE: Final = by_name(
    _STIFFNESS,
    _DAMPING,
    _choice(
        "wall", "Whether the wall acts on both sides of its position", choices=("two-sided", "one-sided"),
        left_out="two-sided",
    ),
    *ENVIRONMENT.values(),
    _flag("no_pull", "The wall never pulls the device inwards"),
    _PLACE("wall_position", "Position of the wall's surface", default=0.0),
    _PLACE(
        "start_position", "Position at the start",
        left_out="1 mm outside an environment with a surface, 1 mm inside any other",
    ),
    _number("start_velocity", "Velocity at the start", "m/s", default=0.0, least=-1e3, most=1e3, value="V"),
    _number(
        "push", "Constant force of the hand towards the wall", "N", least=-1e6, most=1e6, value="F",
        left_out="2 against a surface, unless the hand reaches; else 0",
    ),
    _number(
        "ramp", "Time in which the push rises to its full value", "s", default=0.0, least=0.0, most=1e6, value="S",
    ),
    _vector(
        "tremor", "Amplitude and frequency of a tremor, as a force [N, Hz]", value="N,HZ", lengths=(2,),
        example="0.1,10",
    ),
    _vector(
        "reach", "Displacement of the arm's rest position [m], and start and duration of this motion [s], 0 and "
        "0.5 where left out. Needs an operator", value="M[,START,DURATION]", lengths=(1, 3),
        example="0.01 or 0.01,0,0.5",
    ),
    _vector(
        "reflex", "Stiffen the arm by K and B once the force exceeds N, after a latency and within a rise time "
        "[s]. Needs an operator", value="N,K,B[,LATENCY,RISE]", lengths=(3, 5),
        example="3,500,5 or 3,500,5,0.05,0.05",
    ),
    _number(
        "duration", "Simulated time", "s", above=0.0, most=1e9, value="S",
        left_out="a tenfold change at the predicted rate, and at least eight periods, at most 60 s",
    ),
    _whole(
        "substeps", "Integration steps per sample, where the device or the environment is not linear", default=20,
        least=1, most=100_000,
    ),
    _NOISE_SEED,
    _number(
        "passivity_damping", "Add a time-domain passivity controller, whose damper is at most B", "N s/m",
        above=0.0, value="B", option="passivity",
    ),
    _number(
        "sound_full_scale", "Velocity of the handle at full scale of a .wav [m/s], the same for files to be "
        "compared; faster is clipped", "m/s", least=1e-9, most=1e9, value="V",
        left_out="each file at its own full scale",
    ),
    _number(
        "sound_pitch", "Raise all frequencies of a .wav by this factor; auto: by octaves, to above 200 Hz",
        least=0.1, most=1000.0, value="FACTOR|auto", hint="or give auto",
        left_out="by octaves, from below 60 Hz to above 110 Hz",
    ),
)
EXPERIMENT: Final = by_name(
    _choice(
        "wall", "Whether the wall acts on both sides of its position", choices=("two-sided", "one-sided"),
        default="two-sided",
    ),
    _whole(
        "stiffnesses", "Number of stiffnesses at which the damping is bisected", default=16, least=1, most=1000,
    ),
    _whole("tips", "Number of dampings, near the tip, at which the stiffness is bisected", default=8, most=1000),
    _vector(
        "stiffness", "Range of stiffness to search", "N/m", value="KMIN,KMAX", lengths=(2,), example="0,8000",
        left_out="found by trying",
    ),
    _vector(
        "damping", "Range of damping to search", "N s/m", value="BMIN,BMAX", lengths=(2,), example="0,30",
        left_out="found by trying",
    ),
    _number(
        "disturbance", "Displacement at the start, for a two-sided wall", "m", above=0.0, most=1.0, value="M",
        left_out="0.001",
    ),
    _number(
        "visible", "Largest amplitude of a lasting vibration that counts as none", "m", least=0.0, value="M",
        left_out="three encoder steps and ten standard deviations of the noise",
    ),
    _number("push", "Constant force of the hand", "N", value="F", left_out="2 against a one-sided wall, else 0"),
    _number(
        "speed", "Velocity at the start", "m/s", least=-100.0, most=100.0, value="V",
        left_out="0.02 towards a one-sided wall, else 0",
    ),
    _flag("reflex", "The hand stiffens threefold, 50 ms after the wall has half of the push; needs an operator"),
    _whole("subjects", "Number of operators", default=1, least=1, most=1000),
    _whole("trials", "Number of trials with each operator", default=1, least=1, most=1000),
    _number(
        "spread", "Spread of operators and trials: standard deviation of the logarithm", default=0.2, least=0.0,
        most=2.0, value="S", hint="0.2 is 20 %",
    ),
    _SEED,
    _text(
        "measured", "Your own points, with columns stiffness_N_per_m, damping_Ns_per_m, and edge (lower, upper, "
        "tip) or verdict (stable, unstable); optional: damping_low_Ns_per_m, damping_high_Ns_per_m, "
        "stiffness_low_N_per_m, stiffness_high_N_per_m, trials", value="FILE.csv",
    ),
    replace(
        RUN["store"], name="file", sentence="Keep finished work in this file; the same command continues from it",
        value="FILE",
    ),
)
LIMIT_CYCLES: Final = by_name(
    *WALL.values(),
    _number(
        "offset", "Middle of the vibration, as a share of an encoder step: 0.5 is halfway between two counts, the "
        "most that a constant push can do", default=0.0, least=-0.5, most=0.5, value="SHARE",
    ),
    _flag("no_simulation", "Predict only, without simulation"),
    _text("plane", "Draw the device in the friction-quantisation plane (.png .svg .pdf)", value="FILE"),
)
MOVE: Final = by_name(
    _vector(
        "plane", "A wall behind a plane: a point of it [m], and the direction out of the wall",
        value="X,Y[,Z],NX,NY[,NZ]", lengths=(4, 6), example="0,0.28,0,-1",
    ),
    _vector(
        "sphere", "A ball: its centre and radius", "m", value="X,Y[,Z],R", lengths=(3, 4), example="0,0.3,0.05",
    ),
    _vector(
        "box", "A box along the axes: its centre and half sizes [m]; with two it has no end along z", "m",
        value="X,Y[,Z],HX,HY[,HZ]", lengths=(4, 6), example="0,0.3,0.05,0.02",
    ),
    _flag("two_sided", "The plane holds the handle from both sides"),
    _flag("hollow", "The sphere or box keeps the handle in, not out"),
    replace(_STIFFNESS, least=0.0),
    _DAMPING,
    *ENVIRONMENT.values(),
    _flag("no_pull", "The wall never pulls the handle in"),
    _vector(
        "push", "Force of the hand [N]; one number acts along the direction", "N", value="F|FX,FY[,FZ]",
        lengths=(1, 2, 3), example="2 or 0,2", left_out="none",
    ),
    _vector(
        "start_velocity", "Velocity of the handle at the start [m/s]; one number is along the direction", "m/s",
        value="V|VX,VY[,VZ]", lengths=(1, 2, 3), example="0.1 or 0,0.1", left_out="at rest",
    ),
    replace(LOADS["gravity"], example="0,-9.81", left_out="none"),
    _choice(
        "torque_limits", "Limit each motor by itself, or scale all together, so that the force keeps its "
        "direction", choices=("each", "together"), default="each",
    ),
    _number("duration", "Simulated time", "s", default=1.0, above=0.0, most=1e9, value="S"),
    _whole("substeps", "Integration steps per sample", default=4, least=1, most=100_000),
    _NOISE_SEED,
    _flag("exact", "Ideal encoders: no steps, no noise"),
)

_JOINT = _text(
    "joint", "Drive that was measured, link whose joint it drives, or its number from 1",
    left_out="the only one, or a column joint",
)
_SPRING = _flag(
    "spring", "Whether a spring holds the joint", option="spring/no-spring", default=None,
    left_out="where the data show one",
)
_PATHS = _text(
    "paths", "Number of the device file to be fitted, as a setting names it", value="PATH", option="parameter",
    repeated=True,
)
_SEGMENT = _whole("segment", "Samples of a segment of the averaged spectra", least=64, value="SAMPLES")
IDENTIFY: Final[Mapping[str, Arguments]] = {
    "stiffness": by_name(
        _JOINT,
        _choice(
            "side", "Where torque and angle were measured: at the motor's shaft, or at the link's joint",
            choices=("motor", "link"), default="motor",
        ),
    ),
    "friction": by_name(
        _JOINT,
        _SPRING,
        _flag(
            "mass_from_file", "In free motion, which tells only friction over mass, take the mass that DEVICE "
            "gives",
        ),
    ),
    "mass": by_name(_JOINT, _SPRING),
    "modes": by_name(
        _PATHS,
        _choice(
            "fitted", "Fit the file's numbers and the modes, or the modes alone", choices=("device", "modes"),
            default="device", option="fit",
        ),
        _choice(
            "estimator", "Estimator of the response that is drawn", choices=("H1", "H2", "Hv", "joint"),
            left_out="H1, joint with a reference",
        ),
        replace(_SEGMENT, left_out="15 in a record"),
    ),
    "response": by_name(
        _whole(
            "integrators", "Poles at z = 1: 2 of a free device, 1 with a dashpot, 0 on a spring", most=2,
            left_out="as the data say",
        ),
        replace(
            _SEGMENT, sentence="Samples whose transform resolves what must be told apart", left_out="by itself",
        ),
    ),
    "impedance": by_name(
        replace(_STIFFNESS, sentence="Stiffness of the wall that was on"),
        replace(_DAMPING, sentence="Damping of the wall that was on"),
        replace(
            _SEGMENT, sentence="Samples of a segment of the transforms", left_out="a third of the longest stretch",
        ),
    ),
    "boundary": by_name(
        _PATHS,
        _text(
            "damping_models", "Structural damping that is fitted in place of the file's; several are compared: "
            "modal, stiffness, mass, proportional, drive, hysteretic, or all", option="damping-model",
            repeated=True,
        ),
        _choice(
            "through", "What the points are compared with", choices=("chart", "experiment"), left_out="the exact "
            "chart; simulated trials where dry friction makes the boundary depend on the amplitude",
        ),
        _number("disturbance", "Initial disturbance of those trials", "m", value="M"),
        _number("visible", "Amplitude up to which those trials count as still", "m", value="M"),
    ),
    "arm": by_name(
        _choice(
            "side", "Where angles and torques were recorded: at the links' joints, or at the motors' shafts",
            choices=("joint", "motor"), default="joint",
        ),
        _choice(
            "torque", "Whether the torque acted when it was recorded, or is the computer's command, which acts "
            "after the loop's delay and is held for a period", choices=("measured", "commanded"),
            default="measured",
        ),
        _choice(
            "rotors", "Whether the rotors' inertias are fitted, or taken from the device file",
            choices=("fitted", "known"), default="fitted",
        ),
    ),
}

IMPORT: Final = by_name(
    _text(
        "handle", "Site, body or link that is the handle",
        left_out="the only one with such a name, or the end of a single chain",
    ),
    _choice(
        "controls", "What of the handle the drives control", choices=("position", "orientation", "pose"),
        left_out="the least that tells the posture",
    ),
    _text("keyframe", "Keyframe that is the reference posture"),
    _text(
        "posture", "Joints of the reference posture, as the file counts them [rad] or [m]; others stay",
        value=None,
    ),
    _text("fix", "Joints, or bodies with their joints, to be held still", value="NAME[,NAME]", repeated=True),
    _flag("force", "Overwrite an existing file"),
)
APP: Final = by_name(
    _whole("port", "0: any that is free", default=8440, most=65535, value=None),
    _text(
        "host", "Address to listen on; another than this computer's own needs a token, which is printed",
        default="127.0.0.1", value=None,
    ),
    _text("token", "The token to ask for, instead of a random one", value=None),
    _flag("browser", "Open the page in the browser", default=True, option="browser/no-browser"),
)
# fmt: on
