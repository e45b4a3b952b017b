"""Found by every Python process that a recorded test starts: it records itself, and writes what it executed at
its end."""

import atexit
import os
import sys

if os.environ.get("ZWIDTH_RECORD") and "pytest" not in " ".join(sys.argv[:1] + sys.orig_argv[:4]):
    from tests.verdict.executed import ExecutionRecord

    executed: set[int] = set()
    record = ExecutionRecord()
    record.start()
    record.swap(executed)

    @atexit.register
    def write_what_ran() -> None:
        """Write one line for the test file that started this process."""
        sys.settrace(None)
        from tests.verdict import recorder

        files = sorted(record.read_files | record.helper_modules())
        recorder.write(None, 0.0, record.functions(executed), files)
