"""Controller on a small processor: fixed-point laws, firmware, and processor in the loop."""
