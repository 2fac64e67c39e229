"""Controller on a small processor: fixed-point laws, their firmware, and its trial on a simulator."""
