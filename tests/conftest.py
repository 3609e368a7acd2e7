"""What every test needs."""

import signal

# A shell that starts the tests in the background has Ctrl-C ignored, by them and by all that they start. Some of them
# press it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
