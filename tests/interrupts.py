"""Child processes that Ctrl-C stops, whoever runs the tests."""

import signal


def takes_interrupts() -> None:
    """Let a child process take SIGINT, which shells let background jobs ignore.

    For ``preexec_fn`` of `subprocess.Popen`: what is ignored stays ignored in a new program.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
