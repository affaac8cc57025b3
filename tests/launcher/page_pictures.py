# SPDX-License-Identifier: MIT
"""`make pictures`: the page with a running motor, docs/scope.png; on a phone; and some seconds of it for README: start,
reversal, load. On a machine where the twin is slow those take longer, and are played as they were in the drive's time."""
import io
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("qemu", "qemu/client", "tests", "tests/launcher")]

from browser import browsed, served  # noqa: E402
from PIL import Image  # noqa: E402

DOCS, MOST_BYTES = ROOT / "docs", 2_000_000
FRAME_S, FRAMES = 0.25, 32  # of the drive's time
SMALL = (864, 540)
NAMED = [*(f"curve-{k}" for k in range(1, 4)), "bad", "good", "soft", "text"]  # of the style sheet
SHADES = 6  # of each, towards the ground
PHONE = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
LANDSCAPE = {"width": 1440, "height": 900, "deviceScaleFactor": 1, "mobile": False}
# in frames: what a person does
PLAY = {1: "say('on')", 5: "say('speed 1500')", 13: "say('speed -1500')", 22: "send({ kind: 'disturb', line: 'load_nm 0.15' })",
        28: "send({ kind: 'disturb', line: 'load_nm 0' })"}


def size(page, metrics):
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    page.wait(lambda: page.script("return innerWidth") == metrics["width"])
    time.sleep(0.5)  # drawn at that size


def palette(page):
    """Its own colours, which a choice by how often they are would lose in text."""
    found = [page.script("return colour(arguments[0])", name).lstrip("#") for name in NAMED]
    rgb = [bytes.fromhex(one if len(one) == 6 else "".join(2 * digit for digit in one)) for one in found]
    mixed = [round(c + (255 - c) * k / SHADES) for one in rgb for k in range(SHADES) for c in one] + [255] * 3
    image = Image.new("P", (1, 1))
    image.putpalette(mixed + mixed[-3:] * (256 - len(mixed) // 3))
    return image


def frames(page):
    """Pictures at equal steps of the drive's time."""
    due, colours = page.script("return live.time"), palette(page)
    for number in range(FRAMES):
        if number in PLAY:
            page.script(PLAY[number])
        due += FRAME_S
        page.wait(lambda due=due: page.script("return live.time") >= due)
        shown = Image.open(io.BytesIO(page.browser.get_screenshot_as_png())).convert("RGB").resize(SMALL, Image.LANCZOS)
        yield shown.quantize(palette=colours, dither=Image.Dither.NONE)


def main():
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as (address, _), browsed(address, folder) as page:
        size(page, LANDSCAPE)
        page.script("say('set ramp_rpm_s 3000'); say('scope signals i_d,i_q,i_q_ref,vbus,speed,speed_ref')")
        page.wait(lambda: len(page.script("return live.names")) == 6)
        first, *others = frames(page)
        first.save(DOCS / "scope.gif", save_all=True, append_images=others, duration=round(1000 * FRAME_S), loop=0,
                   optimize=True)
        page.script("say('scope signals i_d,i_q,i_q_ref,vbus,speed,speed_ref,v_q,angle')")
        page.wait(lambda: len(page.script("return live.names")) == 8)
        page.script("say('speed 1500')")
        page.wait(lambda: abs(page.latest("speed") - 1500) < 20)
        page.browser.save_screenshot(str(DOCS / "scope.png"))
        size(page, PHONE)
        page.browser.save_screenshot(str(DOCS / "scope-phone.png"))
        page.click("#stop")
    for name in ("scope.gif", "scope.png", "scope-phone.png"):
        path = DOCS / name
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1e6:.2f} MB")
        if path.stat().st_size > MOST_BYTES:
            sys.exit(f"mssfoc: {name} has more than {MOST_BYTES / 1e6:g} MB")


if __name__ == "__main__":
    main()
