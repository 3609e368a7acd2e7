"""A coroutine is the callback: it runs in the script's event loop, next to other tasks."""

import asyncio

import raycam

world = raycam.World()
world.add_object(box={"size": 1})


async def main():
    with raycam.view(world, port=0, browser=False, block=False) as viewer:
        state = viewer.add_text("state", "idle", editable=False)

        async def measure(control):
            for step in range(3):
                state.value = f"step {step + 1}"
                await asyncio.sleep(0.05)
            state.value = "finished"

        viewer.add_button("measure").on_click(measure)
        await asyncio.to_thread(viewer.wait, exit_when_closed=True)


asyncio.run(main())
