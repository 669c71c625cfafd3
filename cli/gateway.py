"""The verb `gateway`: `up` with one more gateway."""

from __future__ import annotations

from typing import Annotated

import typer

from foosim.runtime.command import new_app

app = new_app()


@app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def gateway(
    context: typer.Context,
    kind: Annotated[str, typer.Argument(help="A kind of gateway, as `foosim components gateway` lists them.")],
    file: Annotated[str, typer.Argument(help="The deployment file.")],
) -> None:
    """Run a deployment with one more gateway, which serves all robots, until Ctrl-C or --for.

    It is short for `foosim up FILE --set "gateways.KIND={kind: KIND}"`, and takes the options of `up`.
    """
    from foosim.cli.up import app as up

    name = kind.rpartition(":")[2].lower()
    words = [file, "--set", f"gateways.{name}={{kind: '{kind}'}}", *context.args]
    typer.main.get_command(up).main(args=words, prog_name="foosim up", standalone_mode=False)
