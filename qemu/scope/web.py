# SPDX-License-Identifier: MIT
"""The page's server: on 127.0.0.1 only, below a random token. Who does not know the token gets nothing, and no page of
another origin can speak to it."""
import asyncio
import json
import secrets
import signal
import struct
import webbrowser
from pathlib import Path

from aiohttp import WSMsgType, web

from launcher.errors import LauncherError
from mssfoc import recording

from .drive import DriveError
from .session import Session

HERE = "127.0.0.1"
PAGE = Path(__file__).resolve().parent / "page"
DYGRAPHS = Path("/usr/share/javascript/dygraphs")
ENUMERATIONS = "enumerations"
QUEUE = 400  # messages that a slow page may be behind
MOST_BYTES = 64 << 20  # of a table that a page wants as a file: 20 s of eight signals have 2 MB


def application(session, token):
    @web.middleware
    async def only_with_token(request, handler):
        host = request.headers.get("Host", "").rsplit(":", 1)[0]
        origin = request.headers.get("Origin")
        known = secrets.compare_digest(request.match_info.get("token", ""), token)
        foreign = origin is not None and origin.rsplit(":", 1)[0] not in (f"http://{HERE}", "http://localhost")
        if not known or foreign or host not in (HERE, "localhost"):
            return web.Response(status=403, text="mssfoc: use the address that 'make scope' has printed\n")
        response = await handler(request)
        if not response.prepared:
            response.headers["Content-Security-Policy"] = (
                "default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; frame-ancestors 'none'")
            response.headers["Referrer-Policy"] = "no-referrer"
            response.headers["Cache-Control"] = "no-store"
        return response

    async def index(_request):
        return web.FileResponse(PAGE / "index.html")

    async def without_slash(request):
        """The page's files lie below its address, which typing may have cut short."""
        raise web.HTTPFound(f"/{request.match_info['token']}/")

    async def file(request):
        name = request.match_info["name"]
        folder = DYGRAPHS if name.startswith("dygraph") else PAGE
        if not (folder / name).is_file() or "/" in name:
            raise web.HTTPNotFound()
        return web.FileResponse(folder / name)

    async def socket(request):
        ws = web.WebSocketResponse(heartbeat=2.0, max_msg_size=4096)
        await ws.prepare(request)
        await _converse(session, ws)
        return ws

    app = web.Application(middlewares=[only_with_token], client_max_size=MOST_BYTES)
    app[ENUMERATIONS] = session.enumerations
    app.router.add_get("/{token}/", index)
    app.router.add_get("/{token}/socket", socket)
    app.router.add_get("/{token}/{name}", file)
    app.router.add_post("/{token}/record.{kind}", _record)
    app.router.add_get("/{token}", without_slash)
    app.router.add_get("/", index)
    return app


async def _record(request):
    """What a page shows, {"names", "units", "rows" of time and values}, as a file for other tools."""
    try:
        wanted = await request.json()
        t_s, *columns = zip(*(map(float, row) for row in wanted["rows"]), strict=True)
        named = dict(zip(wanted["names"], zip(wanted["units"], columns, strict=True), strict=True))
        kind = recording.KINDS[f".{request.match_info['kind']}"]
        body = await asyncio.to_thread(kind, t_s, named, request.app[ENUMERATIONS]())  # the line to the drive goes on
    except (KeyError, TypeError, ValueError, struct.error) as error:
        raise web.HTTPBadRequest(text=f"mssfoc: no table, or no kind of file that is known: {error}\n") from error
    return web.Response(body=body, content_type="application/octet-stream")


async def _converse(session, ws):
    """A page that does not take what it is sent loses samples, and nothing else waits for it."""
    queue = asyncio.Queue()

    def send(message):
        if message["kind"] != "samples" or queue.qsize() < QUEUE:
            queue.put_nowait(json.dumps(message))

    async def pump():
        while True:
            await ws.send_str(await queue.get())

    session.join(ws, send)
    pumping = asyncio.ensure_future(pump())
    asking = set()
    try:
        async for message in ws:
            if message.type != WSMsgType.TEXT:
                continue
            try:
                wanted = json.loads(message.data)
            except ValueError:
                continue
            if isinstance(wanted, dict) and ws in session.pages:
                task = asyncio.ensure_future(session.take(ws, wanted))  # a stop does not wait for a capture to be read
                asking.add(task)
                task.add_done_callback(asking.discard)
    finally:
        pumping.cancel()
        session.leave(ws)


async def _run(far, port, browser):
    session, token = Session(far), secrets.token_urlsafe(24)
    try:
        await session.open()
    except DriveError as error:
        words = far.last_words()
        raise LauncherError(f"{error}\n{words}" if words else str(error)) from error
    runner = web.AppRunner(application(session, token), access_log=None)
    await runner.setup()
    try:
        if not (DYGRAPHS / "dygraph.min.js").is_file():  # behind what the user's own words have wrong
            raise LauncherError("the page's plots need libjs-dygraphs: run make scope, which installs it")
        site = web.TCPSite(runner, HERE, port)
        try:
            await site.start()
        except OSError as error:
            raise LauncherError(f"port {port} of this machine cannot be had: {error.strerror}") from error
        address = f"http://{HERE}:{site._server.sockets[0].getsockname()[1]}/{token}/"
        print(f"{far.title}\n{address}\nCtrl-C ends it; a motor that was started from the page is stopped then.", flush=True)
        if browser:
            await asyncio.to_thread(webbrowser.open, address)
        done = asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):  # HUP: its terminal was closed
            asyncio.get_running_loop().add_signal_handler(number, done.set)
        await done.wait()
    finally:
        await session.close()
        await runner.cleanup()
    return 0


def serve(far, port=0, browser=True):
    """Until it is ended. Returns the exit status."""
    return asyncio.run(_run(far, port, browser))
