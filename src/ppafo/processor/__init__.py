"""Controller on a small processor: fixed-point laws, their firmware, and the processor in the loop."""
