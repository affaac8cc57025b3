# SPDX-License-Identifier: MIT
"""What the swarm has to find: mistakes put into a file of the firmware. `make swarm BUGS=1` prints how many histories each
takes."""
import sys
import tempfile
from pathlib import Path

from rigs.planted import planted
from swarm import lots, play

TWO = ("-DAXIS_COUNT=2u", "-DSCOPE_WORDS=4096u")
BATCH, MOST, OFTEN = 10, 1000, 9

# file, what stands there, what is put in its place; the first OFTEN show within some 30 histories, the others in the night
BUGS = {
    "E6 a lost master is not looked at in a start": (
        "monitor/supervision.c", "    if (turn == SLOW_TURN) {\n        watch_commands(a);\n    }\n    if (no_current",
        "    if (no_current"),
    "E8 a second master takes the motor": ("drive/owner.c", "if (owner == OWNER_NONE ||", "if (true || owner == OWNER_NONE ||"),
    "another's word shuts it down": (
        "operate/cia402.c", "return a->owner.who == (uint32_t)c->who && !owner", "return !owner"),
    "off forgets no restart": (
        "drive/requests.c", "    r->wanted = false;\n    r->waiting = false;\n    r->due = false;\n", ""),
    "off is answered, not carried out": ("drive/requests.c", "    a->request = AXIS_REQUEST_OFF;\n", ""),
    "a fault leaves the gates open": ("fault/fault.c", "gate_disable(&a->fabric->gate);", ";"),
    "a quick stop does not end": ("drive/states.c", "return stop_takes_too_long(a) || stands ?",
                                  "return stop_takes_too_long(a) && stands ?"),
    "heartbeats are not missed": ("operate/canopen_nmt.c", "    c->master_alive = true;\n", ""),
    "commands are not missed": ("monitor/supervision.c", "return limit_ms != 0 &&", "return limit_ms < 0 &&"),
    "E1 a heartbeat lost in a fault is no loss": (
        "operate/canopen_nmt.c", "    c->master_alive = false;\n    canopen_set_error(",
        "    c->master_alive = false;\n    if (!drive_is_on(c->drives[0].axis)) {\n        return;\n    }\n"
        "    canopen_set_error("),
    "E2 stop and reset lose nobody who enabled by SDO": ("operate/canopen_nmt.c", "commands_axis(c, n) && c->lost[n] == 0u",
                                                         "commands_axis(c, n) && c->state == NMT_OPERATIONAL"),
    "E4 reset node keeps the target": ("operate/canopen_nmt.c", "        cia402_init(&d->cia402, OWNER_CAN);\n", ""),
    "who takes over takes a restart": ("drive/owner.c", "        retry_withdraw(&a->retry);\n", ""),
    "the last cause stays": ("fault/fault.c", "if (first) {", "if (true) {"),
    "a set-point twice speed_max": ("drive/mode_speed.c", "mode_within(rpm, a->params.speed_max_rpm,",
                                    "mode_within(rpm, 3 * a->params.speed_max_rpm,"),
    "bus-off is not told": ("operate/canopen_nmt.c", "can_state(c->can) == CAN_OFF || offs != c->bus_offs,", "false,"),
    "clear leaves the bridge locked": ("fault/fault.c", "    bridge_unlock(&a->loop);\n", ""),
    "save writes over the newest": ("settings/slots.c", "view->any ? 1u - view->newest : 0u", "view->any ? view->newest : 0u"),
    "every fault is tried again": ("drive/retry.c", "if (!fault_class((enum fault)a->faults.cause)->retry ||", "if ("),
    "direction turns no set-point": ("drive/modes.c", "return axis_forward(a) < 0 ?", "return axis_forward(a) == 0 ?"),
    "axis 2's line is axis 1's": ("operate/commands_session.c", "    s->axis = &s->axes[value - 1];\n", ""),
    "the encoder is not watched": ("monitor/supervision.c", "return rotor_has_encoder(a) ? encoder_watch_step(a, turn) :",
                                   "return rotor_has_encoder(a) ? turn < TURNS :"),
}


def histories_until_found(name, folder, programs=play.PROGRAMS, seed="1"):
    """(number of the first history in which the mistake shows, what is wrong then); beyond MOST: it does not."""
    environments = [planted(folder, *BUGS[name]), planted(folder, *BUGS[name], *TWO)]
    for first in range(1, MOST + 1, BATCH):
        texts = [lots.history(seed, number) for number in range(first, first + BATCH)]
        for number, findings in enumerate(play.play(texts, programs, environments), first):
            wrong = [what for _, what in findings if not play.known(what)]
            if wrong:
                return number, wrong[0]
    return MOST + 1, "nothing"


def main(seed="1"):
    numbers = []
    for name in BUGS:
        with tempfile.TemporaryDirectory() as folder:
            number, what = histories_until_found(name, Path(folder), seed=seed)
        print(f"{number if number <= MOST else '--':>5}  {name}: {what}", flush=True)
        numbers.append(number)
    print(f"{sum(number <= MOST for number in numbers)} of {len(numbers)} found")
    return max(numbers) > MOST


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
