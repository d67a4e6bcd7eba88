"""The thread that looks at the clock while something plays."""

import time

from app.dock.ticker import Ticker


def test_a_ticker_keeps_its_own_period_and_rests_when_stopped():
    ticks = []
    ticker = Ticker(lambda: ticks.append(time.monotonic()), period_s=0.01)
    assert ticks == []
    ticker.run(True)
    time.sleep(0.3)
    ticker.run(False)
    time.sleep(0.03)
    count = len(ticks)
    assert 3 < count <= 31
    time.sleep(0.05)
    assert len(ticks) == count
    ticker.close()
