class BenchSize: pass
FULL=QUICK=measure_speed=None
