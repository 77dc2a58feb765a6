MODULE Records
  RECORD targetdata
    robtarget position; num cpm;
    string name;
  ENDRECORD
  LOCAL RECORD inner
    pose frame;
  ENDRECORD
  ALIAS num level;
  LOCAL ALIAS targetdata spot;
  PERS targetdata t1:=[[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],5,"a"];
ENDMODULE
