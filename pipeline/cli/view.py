"""The verb view: a gait cycle in a browser, until it is interrupted."""

from __future__ import annotations

import argparse

from pipeline.cli.walk_options import add_force_options, add_machine_options


def add_view_options(sub: argparse.ArgumentParser) -> None:
    """The options of the verb."""
    add_machine_options(sub)
    add_force_options(sub)
    sub.set_defaults(compare_forces=False)
    sub.add_argument("--samples", type=int, default=201, help="samples per half period of the gait")
    sub.add_argument("--host", default="127.0.0.1", help="address to listen on; this machine's own")
    sub.add_argument("--port", type=_port, default=8080, help="port; the next free one if taken")


def _port(text: str) -> int:
    try:
        port = int(text)
    except ValueError:
        port = 0
    if not 0 < port < 65536:
        raise argparse.ArgumentTypeError(f"'{text}' is no port; expected 1 to 65535")
    return port


def run_view(options: argparse.Namespace) -> int:
    """Serve the cycle until interrupted.

    Raises:
        PipelineError: Unusable input.
        ReportError: The package viser is not installed.
    """
    from pipeline.api.pictures.view import player, viser_module
    from pipeline.cli.run import settings_of

    viser_module()  # refused before anything is computed
    given = settings_of(options)
    shown = player(given, host=options.host, port=options.port)
    print(f"open {shown.address} in a browser; Ctrl-C ends it", flush=True)
    try:
        shown.play()
    except KeyboardInterrupt:
        pass
    finally:
        shown.stop()
    return 0
