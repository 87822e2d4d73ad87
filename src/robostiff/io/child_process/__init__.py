"""Reading of untrusted files in a separate process, with limits on time and memory."""

from robostiff.io.child_process.call import ProcessLimits, answer_of

__all__ = ["ProcessLimits", "answer_of"]
