    while (good && status == @NAME@_GOING_ON) {
        status = @name@_step(run);
    }
    if (good && line[0] == '#') {
        @name@_metrics metrics;
        @name@_read_metrics(run, &metrics);
        if (status != @NAME@_FINISHED) {
            fprintf(stderr, "the run failed, which it does not in Python\n");
            good = false;
        }
        do {
            good = good && is_metric_same(line, (const double *)&metrics);
            ++metrics_compared;
        } while (good && fgets(line, LONGEST_LINE, file) != NULL);
    }
