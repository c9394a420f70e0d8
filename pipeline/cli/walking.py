"""The verbs stand, walk, reports and view: options in, one call, lines out."""

from __future__ import annotations

import argparse

from pipeline.cli.options import (
    DECIMAL,
    AddVerb,
    add_out_option,
    add_verbose_option,
    add_walk_options,
    named_path,
    settings_of,
)


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs."""
    for verb, text in (
        ("stand", "standing still: torques, currents, power of every alternative"),
        ("walk", "one walking cycle: demand, stage energies, losses, limits"),
        ("reports", "stand and walk, with all figures and a page, index.html"),
    ):
        sub = add(verb, text, run_reports)
        add_walk_options(sub, samples=751)
        if verb == "walk":
            sub.add_argument(
                "--motion",
                type=named_path,
                metavar="FILE",
                help="CSV to move by instead of the gait: time_s, JOINT__position_rad and, unless "
                "the base is fixed, LEG__contact (0 or 1); base__x_m to base__yaw_rad where known",
            )
        add_out_option(sub)
        add_verbose_option(sub)
    sub = add("view", "play robot, gait and ground forces in a browser, in 3D", run_view)
    add_walk_options(sub, samples=201)
    sub.add_argument("--host", default="127.0.0.1", help="address to listen on; this machine's own")
    sub.add_argument("--port", type=_port, default=8080, help="port; the next free one if taken")


def run_reports(options: argparse.Namespace) -> int:
    """Compute what the verb asks for and write it to the output folder."""
    from pipeline.api.reports import write

    lines = write(settings_of(options), options.verb, options.out, DECIMAL[options.decimal])
    print(*lines, sep="\n")
    return 0


def _port(text: str) -> int:
    if not (text.isdecimal() and 0 < int(text) < 65536):
        raise argparse.ArgumentTypeError(f"'{text}' is no port; expected 1 to 65535")
    return int(text)


def run_view(options: argparse.Namespace) -> int:
    """Serve the cycle until interrupted.

    Raises:
        LegwattError: The package viser is not installed.
    """
    from pipeline.api.pictures.view import Player, viser_module

    viser_module()  # refused before anything is computed
    shown = Player(settings_of(options), host=options.host, port=options.port)
    print(f"open {shown.address} in a browser; Ctrl-C ends it", flush=True)
    try:
        shown.play()
    except KeyboardInterrupt:
        pass
    finally:
        shown.stop()
    return 0
