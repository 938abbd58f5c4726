"""The command line as a person calls it, in this process."""

from click.testing import CliRunner, Result

from gateway.cli import springscale


def called(*arguments: object) -> Result:
    """How the command ended, well or not."""
    return CliRunner().invoke(springscale, [*map(str, arguments)])


def run(*arguments: object) -> Result:
    """Of a command that ends well."""
    done = CliRunner().invoke(springscale, [*map(str, arguments)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done


def printed(*arguments: object) -> str:
    """What a command that ends well says on its standard output."""
    return run(*arguments).stdout
