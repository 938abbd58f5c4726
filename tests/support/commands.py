"""The command line as a person calls it, in this process."""

from click.testing import CliRunner, Result

from gateway.cli import springscale


def called(*arguments: object) -> Result:
    """The result of a command, whether it ends well or not."""
    return CliRunner().invoke(springscale, [*map(str, arguments)])


def run(*arguments: object) -> Result:
    """The result of a command that must end well."""
    done = CliRunner().invoke(springscale, [*map(str, arguments)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done


def printed(*arguments: object) -> str:
    """The standard output of a command that must end well."""
    return run(*arguments).stdout
