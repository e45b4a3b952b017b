"""Every command explains itself, with an example that is typed right."""

from __future__ import annotations

import re
import shlex

import click
import pytest

from tests.cli.command_runner import run_command
from zwidth import __version__
from zwidth.model import MODELS as MODEL_NAMES
from zwidth.questions import DEVICE
from zwidth.show import zwidth as group

COMMANDS = sorted(group.commands)


def test_the_commands_are_those_promised():
    assert set(COMMANDS) == {
        "devices",
        "schema",
        "compile",
        "new",
        "import",
        "identify",
        "show",
        "chart",
        "check",
        "polar",
        "load",
        "map",
        "sweep",
        "optimise",
        "tolerance",
        "export",
        "report",
        "sensitivity",
        "felt",
        "guarantees",
        "robust",
        "bounds",
        "simulate",
        "experiment",
        "limit-cycles",
        "move",
        "app",
    }


@pytest.mark.parametrize("words", [(), ("--help",), ("-h",)])
def test_the_first_help_lists_the_commands(words):
    ran = run_command(*words)
    assert (ran.code, ran.err) == (0, "")
    assert all(f"\n  {name} " in ran.out for name in COMMANDS)
    assert "..." not in ran.out.partition("\n")[2], "a summary is cut"
    assert "Example:" in ran.out


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_explained(name):
    ran = run_command(name, "--help")
    assert (ran.code, ran.err) == (0, "")
    options = [parameter for parameter in group.commands[name].params if isinstance(parameter, click.Option)]
    for option in options:
        assert option.help or option.hidden
        assert option.hidden or option.opts[0] in ran.out


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_the_examples_of_the_help_are_typed_right(name):
    text = run_command(*filter(None, [name]), "--help").out
    examples = re.findall(r"^ +(zwidth .+)$", text.partition("Example:")[2], re.MULTILINE)
    assert examples
    for line in examples:
        words = shlex.split(line.partition(" >")[0])[1:]
        assert words[0] == name or not name
        with group.commands[words[0]].make_context(words[0], words[1:]) as context:
            assert context.params is not None


def test_the_version():
    ran = run_command("--version")
    assert (ran.code, ran.out) == (0, f"zwidth {__version__}\n")


def test_the_models_offered_are_the_models_there_are():
    assert DEVICE["model"].choices == MODEL_NAMES
