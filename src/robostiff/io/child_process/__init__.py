"""Work over files from elsewhere in a process of its own, with limits on time and memory."""

from robostiff.io.child_process.call import ProcessLimits, answer_of

__all__ = ["ProcessLimits", "answer_of"]
