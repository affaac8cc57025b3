# SPDX-License-Identifier: MIT
"""What a scenario does on the bus."""

def send(t_s, data):
    return {"t_s": round(t_s, 7), "event": "bus", "args": [bytes(data).hex()]}
