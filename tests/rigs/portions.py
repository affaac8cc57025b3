# SPDX-License-Identifier: MIT
"""How xdist's workers get their tests: a file at a time, when the last of what they have begins.

xdist itself hands out a share of all that waits, up to thousands of tests: a worker with a portion of long ones then played
for a quarter of an hour when all others had ended. A whole file, since what it measures once is for its neighbours too.
"""
from itertools import islice, takewhile

from xdist.scheduler import LoadScheduling

MOST = 60


class Portions(LoadScheduling):
    def _send_tests(self, node, num):
        if len(self.node2pending[node]) < 2:
            super()._send_tests(node, self._portion())

    def _portion(self):
        """A worker begins no test before it has another one: two at least."""
        files = [self.collection[test].partition("::")[0] for test in islice(self.pending, MOST)]
        return max(2, sum(1 for _ in takewhile(lambda file: file == files[0], files)))
