"""The Rerun recording of a run."""

from validate.recording.recording import write_recording

__all__ = ["write_recording"]
